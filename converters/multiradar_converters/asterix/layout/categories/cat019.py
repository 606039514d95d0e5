"""ASTERIX category 019, status of multilateration: SUR.ET1.ST05.2000-STD-18, edition 1.3."""

EDITIONS = ("1.3",)

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
140 fixed VALUE:24*1/128s  # Time of Day
550 fixed NOGO:2 OVL:1 TSV:1 TTF:1 -:3  # System Status
551 fixed TP1A:1 TP1B:1 TP2A:1 TP2B:1 TP3A:1 TP3B:1 TP4A:1 TP4B:1  # Tracking Processor \
Detailed Status
552 repetitive RSI:8 -:1 RS1090:1 TX1030:1 TX1090:1 RSS:1 RSO:1 -:2  # Remote Sensor Detailed \
Status
553 extended REFTR1:2 -:2 REFTR2:2 -:1 | REFTR3:2 -:2 REFTR4:2 -:1  # Reference Transponder \
Detailed Status
600 fixed LAT:32s*45/268435456deg LON:32s*45/268435456deg  # Position of the MLT System \
Reference Point
610 fixed VALUE:16s*1/4m  # Height of the MLT System Reference Point
620 fixed VALUE:8s*1m  # WGS-84 Undulation
-
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
