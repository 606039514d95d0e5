"""ASTERIX category 023, status of ADS-B ground stations and services: EUROCONTROL-SPEC-0149-16.

Editions 1.2 to 1.3: the later one only uses a spare bit.
"""

EDITIONS = ("1.3", "1.2")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Report Type
015 fixed SID:4 STYP:4  # Service Type and Identification
070 fixed VALUE:24*1/128s  # Time of Day
100 extended NOGO:1 ODP:1 OXT:1 MSC:1 TSV:1 SPO:1 RN:1 | GSSP:7*1s  # Ground Station Status
101 extended RP:8*1/2s SC:3 -:4 | SSRP:7*1s  # Service Configuration
200 fixed VALUE:8*1NM  # Operational Range
110 extended -:4 STAT:3  # Service Status
120 repetitive TYPE:8 REF:1 -:7 CV:32  # Service Statistics
-
-
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
