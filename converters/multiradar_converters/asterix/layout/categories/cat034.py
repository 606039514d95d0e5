"""ASTERIX category 034, monoradar service messages: EUROCONTROL-SPEC-0149-2b.

Editions 1.26 to 1.29: later ones only append octets to extended items.
"""

EDITIONS = ("1.29", "1.28", "1.27", "1.26")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
000 fixed VALUE:8  # Message Type
030 fixed VALUE:24*1/128s  # Time of Day
020 fixed VALUE:8*45/32deg  # Sector Number
041 fixed VALUE:16*1/128s  # Antenna Rotation Speed
050 compound  # System Configuration and Status
    COM fixed NOGO:1 RDPC:1 RDPR:1 OVLRDP:1 OVLXMT:1 MSC:1 TSV:1 -:1
    -
    -
    PSR fixed ANT:1 CHAB:2 OVL:1 MSC:1 -:3
    SSR fixed ANT:1 CHAB:2 OVL:1 MSC:1 -:3
    MDS fixed ANT:1 CHAB:2 OVLSUR:1 MSC:1 SCF:1 DLF:1 OVLSCF:1 OVLDLF:1 -:7
060 compound  # System Processing Mode
    COM fixed -:1 REDRDP:3 REDXMT:3 -:1
    -
    -
    PSR fixed POL:1 REDRAD:3 STC:2 -:2
    SSR fixed REDRAD:3 -:5
    MDS fixed REDRAD:3 CLU:1 -:4
070 repetitive TYP:5 COUNT:11  # Message Count Values
100 fixed RHOST:16*1/256NM RHOEND:16*1/256NM THETAST:16*360/65536deg THETAEND:16*360/65536deg  \
# Generic Polar Window
110 fixed VALUE:8  # Data Filter
120 fixed HGT:16s*1m LAT:24s*45/2097152deg LON:24s*45/2097152deg  # 3D-Position Of Data Source
090 fixed RNG:8s*1/128NM AZM:8s*90/4096deg  # Collimation Error
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
