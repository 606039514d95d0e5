"""ASTERIX category 021, ADS-B reports: EUROCONTROL-SPEC-0149-12.

Editions 2.2 to 2.7 only append octets to extended items; in 2.1 the last octet of item 271 has no
FX bit. Editions 0.23 to 0.26 have another user application profile: their item 040 is fixed, and
0.23 writes positions with 24 bits.
"""

from multiradar_converters.asterix.layout.notation import replaced

EDITIONS = ("2.7", "2.6", "2.5", "2.4", "2.3", "2.2")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identification
040 extended ATP:3 ARC:2 RC:1 RAB:1 | DCR:1 GBS:1 SIM:1 TST:1 SAA:1 CL:2 | -:1 LLC:1 IPC:1 \
NOGO:1 CPR:1 LDPJ:1 RCF:1 | TBC_EP:1 TBC_VAL:6 | MBC_EP:1 MBC_VAL:6  # Target Report Descriptor
161 fixed -:4 TRNUM:12  # Track Number
015 fixed VALUE:8  # Service Identification
071 fixed VALUE:24*1/128s  # Time of Applicability for Position
130 fixed LAT:24s*45/2097152deg LON:24s*45/2097152deg  # Position in WGS-84 Co-ordinates
131 fixed LAT:32s*45/268435456deg LON:32s*45/268435456deg  # High-Resolution Position in WGS-84 \
Co-ordinates
072 fixed VALUE:24*1/128s  # Time of Applicability for Velocity
150 fixed IM:1 AS:15  # Air Speed
151 fixed RE:1 TAS:15*1kt  # True Airspeed
080 fixed VALUE:24  # Target Address
073 fixed VALUE:24*1/128s  # Time of Message Reception for Position
074 fixed FSI:2 TOMRP:30*1/1073741824s  # Time of Message Reception of Position-High Precision
075 fixed VALUE:24*1/128s  # Time of Message Reception for Velocity
076 fixed FSI:2 TOMRP:30*1/1073741824s  # Time of Message Reception of Velocity-High Precision
140 fixed VALUE:16s*25/4ft  # Geometric Height
090 extended NUCRNACV:3 NUCPNIC:4 | NICBARO:1 SIL:2 NACP:4 | -:2 SILS:1 SDA:2 GVA:2 | PIC:4 \
SRC:1 -:2 | -:2 VALSTATE_EP:1 VALSTATE_VAL:2 VD:1 VQ:1 | VALDISTP1:7*128m | VALDISTP2:7*1m | \
VALDISTQUALP1:7*128m | VALDISTQUALP2:7*1m  # Quality Indicators
210 fixed -:1 VNS:1 VN:3 LTT:3  # MOPS Version
070 fixed -:4 MODE3A:12o  # Mode 3/A Code in Octal Representation
230 fixed VALUE:16s*1/100deg  # Roll Angle
145 fixed VALUE:16s*1/4FL  # Flight Level
152 fixed VALUE:16*360/65536deg  # Magnetic Heading
200 fixed ICF:1 LNAV:1 ME:1 PS:3 SS:2  # Target Status
155 fixed RE:1 BVR:15s*25/4ft/min  # Barometric Vertical Rate
157 fixed RE:1 GVR:15s*25/4ft/min  # Geometric Vertical Rate
160 fixed RE:1 GS:15*4/65536NM/s TA:16*360/65536deg  # Airborne Ground Vector
165 fixed -:6 TAR:10s*1/32deg/s  # Track Angle Rate
077 fixed VALUE:24*1/128s  # Time of ASTERIX Report Transmission
170 fixed VALUE:48c  # Target Identification
020 fixed VALUE:8  # Emitter Category
220 compound  # Met Information
    WS fixed VALUE:16*1kt
    WD fixed VALUE:16*1deg
    TMP fixed VALUE:16s*1/4degC
    TRB fixed VALUE:8
146 fixed SAS:1 S:2 ALT:13s*25ft  # Selected Altitude
148 fixed MV:1 AH:1 AM:1 ALT:13s*25ft  # Final State Selected Altitude
110 compound  # Trajectory Intent
    TIS extended NAV:1 NVB:1 -:5
    TID repetitive TCA:1 NC:1 TCPN:6 ALT:16s*10ft LAT:24s*45/2097152deg LON:24s*45/2097152deg \
PT:4 TD:2 TRA:1 TOA:1 TOV:24*1s TTR:16*1/100NM
016 fixed VALUE:8*1/2s  # Service Management
008 fixed RA:1 TC:2 TS:1 ARV:1 CDTIA:1 NOTTCAS:1 SA:1  # Aircraft Operational Status
271 extended -:2 POA:1 CDTIS:1 B2LOW:1 RAS:1 IDENT:1 | LW:4 -:3  # Surface Capabilities and \
Characteristics
132 fixed VALUE:8s*1dBm  # Message Amplitude
250 repetitive VALUE:64x  # Mode S MB Data
260 fixed TYP:5 STYP:3 ARA:14 RAC:4 RAT:1 MTE:1 TTI:2 TID:26  # ACAS Resolution Advisory Report
400 fixed VALUE:8  # Receiver ID
295 compound  # Data Ages
    AOS fixed VALUE:8*1/10s
    TRD fixed VALUE:8*1/10s
    M3A fixed VALUE:8*1/10s
    QI fixed VALUE:8*1/10s
    TI1 fixed VALUE:8*1/10s
    MAM fixed VALUE:8*1/10s
    GH fixed VALUE:8*1/10s
    FL fixed VALUE:8*1/10s
    SAL fixed VALUE:8*1/10s
    FSA fixed VALUE:8*1/10s
    AS fixed VALUE:8*1/10s
    TAS fixed VALUE:8*1/10s
    MH fixed VALUE:8*1/10s
    BVR fixed VALUE:8*1/10s
    GVR fixed VALUE:8*1/10s
    GV fixed VALUE:8*1/10s
    TAR fixed VALUE:8*1/10s
    TI2 fixed VALUE:8*1/10s
    TS fixed VALUE:8*1/10s
    MET fixed VALUE:8*1/10s
    ROA fixed VALUE:8*1/10s
    ARA fixed VALUE:8*1/10s
    SCC fixed VALUE:8*1/10s
-
-
-
-
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""

EDITIONS_2_1 = ("2.1",)

TABLE_2_1 = replaced(
    TABLE,
    "271 extended -:2 POA:1 CDTIS:1 B2LOW:1 RAS:1 IDENT:1 | -:4 LW:4 nofx  # Surface Capabilities",
)

EDITIONS_0_26 = ("0.26", "0.25", "0.24")

TABLE_0_26 = """\
010 fixed SAC:8 SIC:8  # Data Source Identification
040 fixed DCR:1 GBS:1 SIM:1 TST:1 RAB:1 SAA:1 SPI:1 -:1 ATP:3 ARC:2 -:3  # Target Report \
Descriptor
030 fixed VALUE:24*1/128s  # Time of Day
130 fixed LAT:32s*45/8388608deg LON:32s*45/8388608deg  # Position in WGS-84 Co-ordinates
080 fixed VALUE:24  # Target Address
140 fixed VALUE:16s*25/4ft  # Geometric Altitude
090 fixed AC:2 MN:2 DC:2 -:6 PA:4s*1  # Figure of Merit
210 fixed -:3 DTI:1 MDS:1 UAT:1 VDL:1 OTR:1  # Link Technology Indicator
230 fixed VALUE:16s*1/100deg  # Roll Angle
145 fixed VALUE:16s*1/4FL  # Flight Level
150 fixed IM:1 AS:15  # Air Speed
151 fixed VALUE:16*1kt  # True Airspeed
152 fixed VALUE:16*360/65536deg  # Magnetic Heading
155 fixed VALUE:16s*25/4ft/min  # Barometric Vertical Rate
157 fixed VALUE:16s*25/4ft/min  # Geometric Vertical Rate
160 fixed GS:16s*4/65536NM/s TA:16*360/65536deg  # Ground Vector
165 extended TI:2 -:5 | ROT:7s*1/4deg/s  # Rate Of Turn
170 fixed VALUE:48c  # Target Identification
095 fixed VALUE:8  # Velocity Accuracy
032 fixed VALUE:8*1/256s  # Time of Day Accuracy
200 fixed VALUE:8  # Target Status
020 fixed VALUE:8  # Emitter Category
220 compound  # Met Information
    WS fixed VALUE:16*1kt
    WD fixed VALUE:16*1deg
    TMP fixed VALUE:16s*1/4degC
    TRB fixed VALUE:8
146 fixed SAS:1 SRC:2 ALT:13s*25ft  # Intermediate State Selected Altitude
148 fixed MV:1 AH:1 AM:1 ALT:13s*25ft  # Final State Selected Altitude
110 compound  # Trajectory Intent
    TIS extended NAV:1 NVB:1 -:5
    TID repetitive TCA:1 NC:1 TCPN:6 ALT:16s*10ft LAT:24s*45/2097152deg LON:24s*45/2097152deg \
PT:4 TD:2 TRA:1 TOA:1 TOV:24*1s TTR:16*1/100NM
070 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode 3/A Code in Octal Representation
131 fixed VALUE:8  # Signal Amplitude
-
-
-
-
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""

EDITIONS_0_23 = ("0.23",)

TABLE_0_23 = replaced(
    TABLE_0_26,
    "130 fixed LAT:24s*45/2097152deg LON:24s*45/2097152deg  # Position in WGS-84 Co-ordinates",
)
