"""ASTERIX category 008, weather seen by a radar: SUR.ET1.ST05.2000-STD-03.

Editions 1.1 to 1.3: later ones only append octets to extended items.
"""

EDITIONS = ("1.3", "1.2", "1.1")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
020 extended ORG:1 I:3 S:3 | -:5 TST:1 ER:1  # Vector Qualifier
036 repetitive X:8s Y:8s LENGTH:8  # Sequence of Cartesian Vectors in SPF Notation
034 repetitive STR:8 ENDR:8 AZ:16*360/65536deg  # Sequence of Polar Vectors in SPF Notation
040 fixed ORG:1 I:3 -:2 FSTLST:2 CSN:8  # Contour Identifier
050 repetitive X1:8s Y1:8s  # Sequence of Contour Points in SPF Notation
090 fixed VALUE:24*1/128s  # Time of Day
100 extended F:5s R:3 Q:15  # Processing Status
110 list VALUE:7  # Station Configuration Status
120 fixed VALUE:16  # Total Number of Items Constituting One Weather Picture
038 repetitive X1:8s Y1:8s X2:8s Y2:8s  # Sequence of Weather Vectors in SPF Notation
SP explicit  # Special Purpose Field
RFS rfs
"""
