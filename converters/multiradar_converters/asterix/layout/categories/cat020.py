"""ASTERIX category 020, multilateration reports: EUROCONTROL-SPEC-0149-14.

Editions 1.2 to 1.11: later ones only append octets to extended items.
"""

EDITIONS = ("1.11", "1.10", "1.9", "1.8", "1.5", "1.2")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
020 extended SSR:1 MS:1 HF:1 VDL4:1 UAT:1 DME:1 OT:1 | RAB:1 SPI:1 CHN:1 GBS:1 CRT:1 SIM:1 \
TST:1 | CF:2 -:5  # Target Report Descriptor
140 fixed VALUE:24*1/128s  # Time of Day
041 fixed LAT:32s*45/8388608deg LON:32s*45/8388608deg  # Position In WGS-84 Coordinates
042 fixed X:24s*1/2m Y:24s*1/2m  # Position in Cartesian Coordinates
161 fixed -:4 TRN:12  # Track Number
170 extended CNF:1 TRE:1 CST:1 CDM:2 MAH:1 STH:1 | GHO:1 -:6  # Track Status
070 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode-3/A Code in Octal Representation
202 fixed VX:16s*1/4m/s VY:16s*1/4m/s  # Calculated Track Velocity in Cartesian Coordinates
090 fixed V:1 G:1 FL:14s*1/4FL  # Flight Level in Binary Representation
100 fixed V:1 G:1 -:2 MODEC:12 -:4 QC1:1 QA1:1 QC2:1 QA2:1 QC4:1 QA4:1 QB1:1 QD1:1 QB2:1 QD2:1 \
QB4:1 QD4:1  # Mode C Code
220 fixed VALUE:24  # Target Address
245 fixed STI:2 -:6 CHR:48c  # Target Identification
110 fixed VALUE:16s*25/4ft  # Measured Height (Local Cartesian Coordinates)
105 fixed VALUE:16s*25/4ft  # Geometric Height (WGS-84)
210 fixed AX:8s*1/4m/s² AY:8s*1/4m/s²  # Calculated Acceleration
300 fixed VALUE:8  # Vehicle Fleet Identification
310 fixed TRB:1 MSG:7  # Pre-programmed Message
500 compound  # Position Accuracy
    DOP fixed X:16*1/4 Y:16*1/4 XY:16*1/4
    SDP fixed X:16*1/4m Y:16*1/4m XY:16*1/4
    SDH fixed VALUE:16*1/2m
400 repetitive BIT1:1 BIT2:1 BIT3:1 BIT4:1 BIT5:1 BIT6:1 BIT7:1 BIT8:1  # Contributing Devices
250 repetitive BDSDATA:56 BDS1:4 BDS2:4  # BDS Register Data
230 fixed COM:3 STAT:3 CASEVN:2 MSSC:1 ARC:1 AIC:1 B1A:1 B1B:4  # Communications/ACAS \
Capability and Flight Status
260 fixed VALUE:56  # ACAS Resolution Advisory Report
030 list VALUE:7  # Warning/Error Conditions
055 fixed V:1 G:1 L:1 MODE1:5  # Mode-1 Code in Octal Representation
050 fixed V:1 G:1 L:1 -:1 MODE2:12o  # Mode-2 Code in Octal Representation
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
