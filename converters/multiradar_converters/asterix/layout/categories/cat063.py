"""ASTERIX category 063, sensor status: EUROCONTROL-SPEC-0149-10.

Editions 1.0 to 1.7: later ones only append octets to extended items.
"""

EDITIONS = ("1.7", "1.6", "1.0")

TABLE = """\
010 fixed SAC:8 SIC:8  # Data Source Identifier
015 fixed VALUE:8  # Service Identification
030 fixed VALUE:24*1/128s  # Time of Message
050 fixed SAC:8 SIC:8  # Sensor Identifier
060 extended CON:2 PSR:1 SSR:1 MDS:1 ADS:1 MLT:1 | OPS:1 ODP:1 OXT:1 MSC:1 TSV:1 NPW:1 -:1 | \
TTF_EP:1 TTF_VAL:1 SPO_EP:1 SPO_VAL:1 -:3  # Sensor Configuration and Status
070 fixed VALUE:16s*1ms  # Time Stamping Bias
080 fixed SRG:16s*1/100000 SRB:16s*1/128NM  # SSR / Mode S Range Gain and Bias
081 fixed VALUE:16s*360/65536deg  # SSR Mode S Azimuth Bias
090 fixed PRG:16s*1/100000 PRB:16s*1/128NM  # PSR Range Gain and Bias
091 fixed VALUE:16s*360/65536deg  # PSR Azimuth Bias
092 fixed VALUE:16s*360/65536deg  # PSR Elevation Bias
-
RE explicit  # Reserved Expansion Field
SP explicit  # Special Purpose Field
"""
