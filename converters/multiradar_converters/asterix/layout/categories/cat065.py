"""ASTERIX category 065, status of a surveillance processor: EUROCONTROL-SPEC-0149-15.

Editions 1.3 to 1.6: later ones only append octets to extended items.
"""

EDITIONS = ("1.6", "1.5", "1.4", "1.3")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
015 fixed VALUE:8  # Service Identification
030 fixed VALUE:24*1/128s  # Time of Message
020 fixed VALUE:8  # Batch Number
040 fixed NOGO:2 OVL:1 TSV:1 PSS:2 STTN:1 -:1  # SDPS Configuration and Status
050 fixed VALUE:8  # Service Status Report
-
-
-
-
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
