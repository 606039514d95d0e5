"""ASTERIX category 247, version numbers: EUROCONTROL-SPEC-0149-20.

Editions 1.2 to 1.3: later ones only append octets to extended items.
"""

EDITIONS = ("1.3", "1.2")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
015 fixed VALUE:8  # Service Identification
140 fixed VALUE:24*1/128s  # Time of Day
550 repetitive CAT:8 MAIN:8 SUB:8  # Category Version Number Report
-
SP explicit  # Special Purpose Field
RE explicit  # Reserved Expansion Field
"""
