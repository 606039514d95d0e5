"""ASTERIX category 002, monoradar service messages: SUR.ET1.ST05.2000-STD-02b.

Editions 1.0 to 1.2: later ones only append octets to extended items.
"""

EDITIONS = ("1.2", "1.1", "1.0")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
020 fixed VALUE:8*45/32deg  # Sector Number
030 fixed VALUE:24*1/128s  # Time of Day
041 fixed VALUE:16*1/128s  # Antenna Rotation Speed
050 list VALUE:7  # Station Configuration Status
060 list VALUE:7  # Station Processing Mode
070 repetitive A:1 IDENT:5 COUNTER:10  # Plot Count Values
100 fixed RS:16*1/128NM RE:16*1/128NM TS:16*360/65536deg TE:16*360/65536deg  # Dynamic Window \
Type 1
090 fixed RE:8s*1/128NM AE:8s*90/4096deg  # Collimation Error
080 list VALUE:7  # Warning/Error Conditions
-
SP explicit  # Special Purpose Field
RFS rfs
"""
