"""ASTERIX category 004, safety net messages: EUROCONTROL-SPEC-0149-17.

Editions 1.4 to 1.13: later ones only append octets to extended items.
"""

EDITIONS = ("1.13", "1.12", "1.4")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
015 repetitive SAC:8 SIC:8  # SDPS Identifier
020 fixed VALUE:24*1/128s  # Time of Message
040 fixed VALUE:16  # Alert Identifier
045 fixed AREA_EP:1 AREA_VAL:3 STAT:3 -:1  # Area and Alert Status
060 extended MRVA:1 RAMLD:1 RAMHD:1 MSAW:1 APW:1 CLAM:1 STCA:1 | APM:1 RIMCA:1 ACASRA:1 NTCA:1 \
DG:1 OF:1 OL:1 | AIW:1 PAIW:1 OCAT:1 SAM:1 VCD:1 CHAM:1 DSAM:1 | DBPSMARR:1 DBPSMDEP:1 \
DBPSMTL:1 VRAMCRM:1 VRAMVTM:1 VRAMVRM:1 HAMHD:1 | HAMRD:1 HAMVD:1 HVI:1 LTW:1 VPM:1 TTA:1 CRA:1 \
| ASM:1 IAVM:1 FTD:1 ITD:1 IIA:1 SQW:1 CUW:1 | CATC:1 NOCLR:1 NOMOV:1 NOH:1 WRTY:1 STOCC:1 \
ONGOING:1 | NTZ:1 -:6  # Safety Net Function and System Status
030 fixed VALUE:16  # Track Number 1
170 compound  # Aircraft Identification and Characteristics 1
    AI1 fixed VALUE:56a
    M31 fixed -:4 MODE3A:12o
    CPW fixed LAT:32s*45/8388608deg LON:32s*45/8388608deg ALT:16s*25ft
    CPC fixed X:24s*1/2m Y:24s*1/2m Z:16s*25ft
    TT1 fixed VALUE:24*1/128s
    DT1 fixed VALUE:16*1/2m
    AC1 extended GATOAT:2 FR1FR2:2 RVSM:2 HPR:1 | CDM:2 PRI:1 GV:1 -:3
    MS1 fixed VALUE:48c
    FP1 fixed -:5 NBR:27*1
    CF1 fixed VALUE:16*1/4FL
120 compound  # Conflict Characteristics
    CN extended MAS:1 CAS:1 FLD:1 FVD:1 TYPE:1 CROSS:1 DIV:1 | RRC:1 RTC:1 MRVA:1 VRAMCRM:1 \
VRAMVRM:1 VRAMVTM:1 HAMHD:1 | HAMRD:1 HAMVD:1 DBPSMARR:1 DBPSMDEP:1 DBPSMTL:1 AIW:1 -:1
    CC fixed TID:4 CPC:3 CS:1
    CP fixed VALUE:8*1/2%
    CD fixed VALUE:24*1/128s
070 compound  # Conflict Timing and Separation
    TC fixed VALUE:24*1/128s
    TCA fixed VALUE:24*1/128s
    CHS fixed VALUE:24*1/2m
    MHS fixed VALUE:16*1/2m
    CVS fixed VALUE:16*25ft
    MVS fixed VALUE:16*25ft
076 fixed VALUE:16s*25ft  # Vertical Deviation
074 fixed VALUE:16s*32m  # Longitudinal Deviation
075 fixed VALUE:24s*1/2m  # Transversal Distance Deviation
100 compound  # Area Definition
    AN fixed VALUE:48c
    CAN fixed VALUE:56a
    RT1 fixed VALUE:56a
    RT2 fixed VALUE:56a
    SB fixed VALUE:56a
    G fixed VALUE:56a
035 fixed VALUE:16  # Track Number 2
171 compound  # Aircraft Identification and Characteristics 2
    AI2 fixed VALUE:56a
    M32 fixed -:4 MODE3A:12o
    CPW fixed LAT:32s*45/8388608deg LON:32s*45/8388608deg ALT:16s*25ft
    CPL fixed X:24s*1/2m Y:24s*1/2m Z:16s*25ft
    TT2 fixed VALUE:24*1/128s
    DT2 fixed VALUE:16*1/2m
    AC2 extended GATOAT:2 FR1FR2:2 RVSM:2 HPR:1 | CDM:2 PRI:1 GV:1 -:3
    MS2 fixed VALUE:48c
    FP2 fixed -:5 NBR:27*1
    CF2 fixed VALUE:16*1/4FL
110 repetitive CEN:8 POS:8  # FDPS Sector Control Identification
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
