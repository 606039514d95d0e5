"""ASTERIX category 062, system tracks: EUROCONTROL-SPEC-0149-9.

Editions 1.12 to 1.21: later ones only append octets to extended items. Some processors write eight
letters in item 390/CS, where the standard has seven; their layout is named after edition 1.17.
"""

from multiradar_converters.asterix.layout.notation import replaced

EDITIONS = ("1.21", "1.20", "1.19", "1.18", "1.17", "1.16", "1.12")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
-
015 fixed VALUE:8  # Service Identification
070 fixed VALUE:24*1/128s  # Time Of Track Information
105 fixed LAT:32s*45/8388608deg LON:32s*45/8388608deg  # Calculated Position In WGS-84 \
Co-ordinates
100 fixed X:24s*1/2m Y:24s*1/2m  # Calculated Track Position (Cartesian)
185 fixed VX:16s*1/4m/s VY:16s*1/4m/s  # Calculated Track Velocity (Cartesian)
210 fixed AX:8s*1/4m/s² AY:8s*1/4m/s²  # Calculated Acceleration (Cartesian)
060 fixed V:1 G:1 CH:1 -:1 MODE3A:12o  # Track Mode 3/A Code
245 fixed STI:2 -:6 CHR:48c  # Target Identification
380 compound  # Aircraft Derived Data
    ADR fixed VALUE:24
    ID fixed VALUE:48c
    MHG fixed VALUE:16*360/65536deg
    IAS fixed IM:1 IAS:15
    TAS fixed VALUE:16*1kt
    SAL fixed SAS:1 SRC:2 ALT:13s*25ft
    FSS fixed MV:1 AH:1 AM:1 ALT:13s*25ft
    TIS extended NAV:1 NVB:1 -:5
    TID repetitive TCA:1 NC:1 TCPN:6 ALT:16s*10ft LAT:24s*45/2097152deg LON:24s*45/2097152deg \
PT:4 TD:2 TRA:1 TOA:1 TOV:24*1s TTR:16*1/100NM
    COM fixed COM:3 STAT:3 -:2 SSC:1 ARC:1 AIC:1 B1A:1 B1B:4
    SAB fixed AC:2 MN:2 DC:2 GBS:1 -:6 STAT:3
    ACS fixed VALUE:56x
    BVR fixed VALUE:16s*25/4ft/min
    GVR fixed VALUE:16s*25/4ft/min
    RAN fixed VALUE:16s*1/100deg
    TAR fixed TI:2 -:6 ROT:7s*1/4deg/s -:1
    TAN fixed VALUE:16*360/65536deg
    GS fixed VALUE:16s*4/65536NM/s
    VUN fixed VALUE:8
    MET fixed WS:1 WD:1 TMP:1 TRB:1 -:4 WSD:16*1kt WDD:16*1deg TMPD:16s*1/4degC TRBD:8
    EMC fixed VALUE:8
    POS fixed LAT:24s*45/2097152deg LON:24s*45/2097152deg
    GAL fixed VALUE:16s*25/4ft
    PUN fixed -:4 PUN:4
    BDSDATA repetitive VALUE:64x
    IAR fixed VALUE:16*1kt
    MAC fixed VALUE:16*8/1000Mach
    BPS fixed -:4 BPS:12*1/10mb
040 fixed VALUE:16  # Track Number
080 extended MON:1 SPI:1 MRH:1 SRC:3 CNF:1 | SIM:1 TSE:1 TSB:1 FPC:1 AFF:1 STP:1 KOS:1 | AMA:1 \
MD4:2 ME:1 MI:1 MD5:2 | CST:1 PSR:1 SSR:1 MDS:1 ADS:1 SUC:1 AAC:1 | SDS:2 EMS:3 PFT:1 FPLT:1 | \
DUPT:1 DUPF:1 DUPM:1 SFC:1 IDD:1 IEC:1 MLAT:1 | M5I:1 -:6  # Track Status
290 compound  # System Track Update Ages
    TRK fixed VALUE:8*1/4s
    PSR fixed VALUE:8*1/4s
    SSR fixed VALUE:8*1/4s
    MDS fixed VALUE:8*1/4s
    ADS fixed VALUE:16*1/4s
    ES fixed VALUE:8*1/4s
    VDL fixed VALUE:8*1/4s
    UAT fixed VALUE:8*1/4s
    LOP fixed VALUE:8*1/4s
    MLT fixed VALUE:8*1/4s
200 fixed TRANS:2 LONG:2 VERT:2 ADF:1 -:1  # Mode of Movement
295 compound  # Track Data Ages
    MFL fixed VALUE:8*1/4s
    MD1 fixed VALUE:8*1/4s
    MD2 fixed VALUE:8*1/4s
    MDA fixed VALUE:8*1/4s
    MD4 fixed VALUE:8*1/4s
    MD5 fixed VALUE:8*1/4s
    MHG fixed VALUE:8*1/4s
    IAS fixed VALUE:8*1/4s
    TAS fixed VALUE:8*1/4s
    SAL fixed VALUE:8*1/4s
    FSS fixed VALUE:8*1/4s
    TID fixed VALUE:8*1/4s
    COM fixed VALUE:8*1/4s
    SAB fixed VALUE:8*1/4s
    ACS fixed VALUE:8*1/4s
    BVR fixed VALUE:8*1/4s
    GVR fixed VALUE:8*1/4s
    RAN fixed VALUE:8*1/4s
    TAR fixed VALUE:8*1/4s
    TAN fixed VALUE:8*1/4s
    GSP fixed VALUE:8*1/4s
    VUN fixed VALUE:8*1/4s
    MET fixed VALUE:8*1/4s
    EMC fixed VALUE:8*1/4s
    POS fixed VALUE:8*1/4s
    GAL fixed VALUE:8*1/4s
    PUN fixed VALUE:8*1/4s
    MB fixed VALUE:8*1/4s
    IAR fixed VALUE:8*1/4s
    MAC fixed VALUE:8*1/4s
    BPS fixed VALUE:8*1/4s
136 fixed VALUE:16s*1/4FL  # Measured Flight Level
130 fixed VALUE:16s*25/4ft  # Calculated Track Geometric Altitude
135 fixed QNH:1 CTB:15s*1/4FL  # Calculated Track Barometric Altitude
220 fixed VALUE:16s*25/4ft/min  # Calculated Rate of Climb/Descent
390 compound  # Flight Plan Related Data
    TAG fixed SAC:8 SIC:8
    CS fixed VALUE:56a
    IFI fixed TYP:2 -:3 NBR:27
    FCT fixed GATOAT:2 FR1FR2:2 RVSM:2 HPR:1 -:1
    TAC fixed VALUE:32a
    WTC fixed VALUE:8a
    DEP fixed VALUE:32a
    DST fixed VALUE:32a
    RDS fixed NU1:8a NU2:8a LTR:8a
    CFL fixed VALUE:16*1/4FL
    CTL fixed CENTRE:8 POSITION:8
    TOD repetitive TYP:5 DAY:2 -:4 HOR:5 -:2 MIN:6 AVS:1 -:1 SEC:6
    AST fixed VALUE:48a
    STS fixed EMP:2 AVL:2 -:4
    STD fixed VALUE:56a
    STA fixed VALUE:56a
    PEM fixed -:3 VA:1 MODE3A:12o
    PEC fixed VALUE:56a
270 extended LENGTH:7*1m | ORIENTATION:7*45/16deg | WIDTH:7*1m  # Target Size and Orientation
300 fixed VALUE:8  # Vehicle Fleet Identification
110 compound  # Mode 5 Data Reports and Extended Mode 1 Code
    SUM fixed M5:1 ID:1 DA:1 M1:1 M2:1 M3:1 MC:1 X:1
    PMN fixed -:2 PIN:14 -:3 NAT:5 -:2 MIS:6
    POS fixed LAT:24s*45/2097152deg LON:24s*45/2097152deg
    GA fixed -:1 RES:1 GA:14s*25ft
    EM1 fixed -:4 EM1:12o
    TOS fixed VALUE:8s*1/128s
    XP fixed -:3 X5:1 XC:1 X3:1 X2:1 X1:1
120 fixed -:4 MODE2:12o  # Track Mode 2 Code
510 list IDENT:8 TRACK:15  # Composed Track Number
500 compound  # Estimated Accuracies
    APC fixed X:16*1/2m Y:16*1/2m
    COV fixed VALUE:16s*1/2m
    APW fixed LAT:16*45/8388608deg LON:16*45/8388608deg
    AGA fixed VALUE:8*25/4ft
    ABA fixed VALUE:8*1/4FL
    ATV fixed X:8*1/4m/s Y:8*1/4m/s
    AA fixed X:8*1/4m/s² Y:8*1/4m/s²
    ARC fixed VALUE:8*25/4ft/min
340 compound  # Measured Information
    SID fixed SAC:8 SIC:8
    POS fixed RHO:16*1/256NM THETA:16*360/65536deg
    HEIGHT fixed VALUE:16s*25ft
    MDC fixed V:1 G:1 LMC:14s*1/4FL
    MDA fixed V:1 G:1 L:1 -:1 MODE3A:12o
    TYP fixed TYP:3 SIM:1 RAB:1 TST:1 -:2
-
-
-
-
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""

EDITIONS_EIGHT_LETTERS = ("1.17-cs8",)

TABLE_EIGHT_LETTERS = replaced(TABLE, "    CS fixed VALUE:64a")
