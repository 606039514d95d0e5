"""ASTERIX category 048, monoradar plots and tracks: EUROCONTROL-SPEC-0149-4.

Editions 1.15 to 1.32: later ones only append octets to extended items.
"""

EDITIONS = ("1.32", "1.31", "1.30", "1.29", "1.28", "1.27", "1.23", "1.21", "1.15")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
140 fixed VALUE:24*1/128s  # Time of Day
020 extended TYP:3 SIM:1 RDP:1 SPI:1 RAB:1 | TST:1 ERR:1 XPP:1 ME:1 MI:1 FOEFRI:2 | ADSB_EP:1 \
ADSB_VAL:1 SCN_EP:1 SCN_VAL:1 PAI_EP:1 PAI_VAL:1 -:1 | ACASXV_EP:1 ACASXV_VAL:4 POXPR_EP:1 \
POXPR_VAL:1 | POACT_EP:1 POACT_VAL:1 DTFXPR_EP:1 DTFXPR_VAL:1 DTFACT_EP:1 DTFACT_VAL:1 -:1 | \
IRMXPR_EP:1 IRMXPR_VAL:1 IRMACT_EP:1 IRMACT_VAL:1 -:3  # Target Report Descriptor
040 fixed RHO:16*1/256NM THETA:16*360/65536deg  # Measured Position in Polar Co-ordinates
070 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode-3/A Code in Octal Representation
090 fixed V:1 G:1 FL:14s*1/4FL  # Flight Level in Binary Representation
130 compound  # Radar Plot Characteristics
    SRL fixed VALUE:8*45/1024deg
    SRR fixed VALUE:8
    SAM fixed VALUE:8s*1dBm
    PRL fixed VALUE:8*45/1024deg
    PAM fixed VALUE:8s*1dBm
    RPD fixed VALUE:8s*1/256NM
    APD fixed VALUE:8s*90/4096deg
220 fixed VALUE:24  # Aircraft Address
240 fixed VALUE:48c  # Aircraft Identification
250 repetitive MBDATA:56 BDS1:4 BDS2:4  # BDS Register Data
161 fixed -:4 TRN:12  # Track Number
042 fixed X:16s*1/128NM Y:16s*1/128NM  # Calculated Position in Cartesian Co-ordinates
200 fixed GSP:16*4/65536NM/s HDG:16*360/65536deg  # Calculated Track Velocity in Polar \
Co-ordinates
170 extended CNF:1 RAD:2 DOU:1 MAH:1 CDM:2 | TRE:1 GHO:1 SUP:1 TCC:1 -:3  # Track Status
210 fixed SIGX:8*1/128NM SIGY:8*1/128NM SIGV:8*4/65536NM/s SIGH:8*45/512deg  # Track Quality
030 list VALUE:7  # Warning/Error Conditions and Target Classification
080 fixed -:4 QA4:1 QA2:1 QA1:1 QB4:1 QB2:1 QB1:1 QC4:1 QC2:1 QC1:1 QD4:1 QD2:1 QD1:1  # \
Mode-3/A Code Confidence Indicator
100 fixed V:1 G:1 -:2 MODEC:12 -:4 QC1:1 QA1:1 QC2:1 QA2:1 QC4:1 QA4:1 QB1:1 QD1:1 QB2:1 QD2:1 \
QB4:1 QD4:1  # Mode-C Code and Code Confidence Indicator
110 fixed -:2 3DH:14s*25ft  # Height Measured by a 3D Radar
120 compound  # Radial Doppler Speed
    CAL fixed D:1 -:5 CAL:10s*1m/s
    RDS repetitive DOP:16*1m/s AMB:16*1m/s FRQ:16*1MHz
230 fixed COM:3 STAT:3 SI:1 -:1 MSSC:1 ARC:1 AIC:1 B1A:1 B1B:4  # Communications/ACAS \
Capability and Flight Status
260 fixed VALUE:56  # ACAS Resolution Advisory Report
055 fixed V:1 G:1 L:1 MODE1:5  # Mode-1 Code in Octal Representation
050 fixed V:1 G:1 L:1 -:1 MODE2:12o  # Mode-2 Code in Octal Representation
065 fixed -:3 QA4:1 QA2:1 QA1:1 QB2:1 QB1:1  # Mode-1 Code Confidence Indicator
060 fixed -:4 QA4:1 QA2:1 QA1:1 QB4:1 QB2:1 QB1:1 QC4:1 QC2:1 QC1:1 QD4:1 QD2:1 QD1:1  # Mode-2 \
Code Confidence Indicator
SP explicit  # Special Purpose Field
RE explicit  # Reserved Expansion Field
"""
