"""ASTERIX category 010, surface movements: SUR.ET1.ST05.2000-STD-07.

Editions 0.31 and 1.1 have the same layout. Edition 0.24 is that of a multilateration manufacturer
(Sensis), with a different user application profile.
"""

EDITIONS = ("1.1", "0.31")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
020 extended TYP:3 DCR:1 CHN:1 GBS:1 CRT:1 | SIM:1 TST:1 RAB:1 LOP:2 TOT:2 | SPI:1 -:6  # \
Target Report Descriptor
140 fixed VALUE:24*1/128s  # Time of Day
041 fixed LAT:32s*45/536870912deg LON:32s*45/536870912deg  # Position in WGS-84 Co-ordinates
040 fixed RHO:16*1m TH:16*360/65536deg  # Measured Position in Polar Co-ordinates
042 fixed X:16s*1m Y:16s*1m  # Position in Cartesian Co-ordinates
200 fixed GSP:16*4/65536NM/s TRA:16*360/65536deg  # Calculated Track Velocity in Polar \
Co-ordinates
202 fixed VX:16s*1/4m/s VY:16s*1/4m/s  # Calculated Track Velocity in Cartesian Co-ordinates
161 fixed -:4 TRK:12  # Track Number
170 extended CNF:1 TRE:1 CST:2 MAH:1 TCC:1 STH:1 | TOM:2 DOU:3 MRS:2 | GHO:1 -:6  # Track Status
060 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode-3/A Code in Octal Representation
220 fixed VALUE:24  # Target Address
245 fixed STI:2 -:6 CHR:48c  # Target Identification
250 repetitive MBDATA:56 BDS1:4 BDS2:4  # Mode S MB Data
300 fixed VALUE:8  # Vehicle Fleet Identification
090 fixed V:1 G:1 FL:14s*1/4FL  # Flight Level in Binary Representation
091 fixed VALUE:16s*25/4ft  # Measured Height
270 extended LENGTH:7*1m | ORIENTATION:7*45/16deg | WIDTH:7*1m  # Target Size and Orientation
550 fixed NOGO:2 OVL:1 TSV:1 DIV:1 TTF:1 -:2  # System Status
310 fixed TRB:1 MSG:7  # Pre-programmed Message
500 fixed DEVX:8*1/4m DEVY:8*1/4m COVXY:16s*1/4m  # Standard Deviation of Position
280 repetitive DRHO:8s*1m DTHETA:8s*3/20deg  # Presence
131 fixed VALUE:8  # Amplitude of Primary Plot
210 fixed AX:8s*1/4m/s² AY:8s*1/4m/s²  # Calculated Acceleration
-
SP explicit  # Special Purpose Field
RE explicit  # Reserved Expansion Field
"""

EDITIONS_0_24 = ("0.24",)

TABLE_0_24 = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
020 extended TYP:3 DCR:1 CHN:1 GBS:1 CRT:1 | SIM:1 TST:1 RAB:1 LOP:2 TOT:2 | SPI:1 -:6  # \
Target Report Descriptor
140 fixed VALUE:24*1/128s  # Time of Day
041 fixed LAT:32s*45/536870912deg LON:32s*45/536870912deg  # Position in WGS-84 Co-ordinates
-
042 fixed X:16s*1m Y:16s*1m  # Position in Cartesian Co-ordinates
-
202 fixed VX:12s VY:12s  # Calculated Track Velocity in Cartesian Co-ordinates
161 fixed -:4 TRK:12  # Track Number
170 extended CNF:1 TRE:1 CST:2 MAH:1 TCC:1 STH:1 | TOM:2 DOU:3 MRS:2 | GHO:1 -:6  # Track Status
060 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode-3/A Code in Octal Representation
220 fixed VALUE:24  # Target Address
245 fixed STI:2 -:6 CHR:48c  # Target Identification
-
-
090 fixed V:1 G:1 FL:14s*1/4FL  # Flight Level in Binary Representation
091 fixed VALUE:16s*25/4ft  # Measured Height
-
550 fixed NOGO:2 OVL:1 TSV:1 DIV:1 TTF:1 -:2  # System Status
-
500 fixed DEVX:8*1/4m DEVY:8*1/4m COVXY:16s*1/4m  # Standard Deviation of Position
-
-
-
-
SP explicit  # Special Purpose Field
RE explicit  # Reserved Expansion Field
"""
