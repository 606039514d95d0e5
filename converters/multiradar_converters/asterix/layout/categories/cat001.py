"""ASTERIX category 001, monoradar plots and tracks: SUR.ET1.ST05.2000-STD-02a.

Editions 1.0 to 1.4: later ones only append octets to extended items.
"""

EDITIONS = ("1.4", "1.3", "1.2", "1.1", "1.0")

TABLE = """\
== plot
010 fixed SAC:8 SIC:8  # Data Source Identifier
020 extended TYP:1 SIM:1 SSRPSR:2 ANT:1 SPI:1 RAB:1 | TST:1 DS1DS2:2 ME:1 MI:1 -:2  # Target \
Report Descriptor
040 fixed RHO:16*1/128NM THETA:16*360/65536deg  # Measured Position in Polar Co-ordinates
070 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode-3/A Code in Octal Representation
090 fixed V:1 G:1 HGT:14s*1/4FL  # Mode-C Code in Binary Representation
130 list VALUE:7  # Radar Plot Characteristics
141 fixed VALUE:16*1/128s  # Truncated Time of Day
050 fixed V:1 G:1 L:1 -:1 MODE2:12o  # Mode-2 Code in Octal Representation
120 fixed VALUE:8s*1/256NM/s  # Measured Radial Doppler Speed
131 fixed VALUE:8s*1dBm  # Received Power
080 fixed -:4 QA4:1 QA2:1 QA1:1 QB4:1 QB2:1 QB1:1 QC4:1 QC2:1 QC1:1 QD4:1 QD2:1 QD1:1  # \
Mode-3/A Code Confidence Indicator
100 fixed V:1 G:1 -:2 MODEC:12 -:4 QC1:1 QA1:1 QC2:1 QA2:1 QC4:1 QA4:1 QB1:1 QD1:1 QB2:1 QD2:1 \
QB4:1 QD4:1  # Mode-C Code and Code Confidence Indicator
060 fixed -:4 QA4:1 QA2:1 QA1:1 QB4:1 QB2:1 QB1:1 QC4:1 QC2:1 QC1:1 QD4:1 QD2:1 QD1:1  # Mode-2 \
Code Confidence Indicator
030 list VALUE:7  # Warning/Error Conditions
150 fixed XA:1 -:1 XC:1 -:2 X2:1 -:2  # Presence of X-Pulse
-
-
-
-
SP explicit  # Special Purpose Field
RFS rfs
== track
010 fixed SAC:8 SIC:8  # Data Source Identifier
020 extended TYP:1 SIM:1 SSRPSR:2 ANT:1 SPI:1 RAB:1 | TST:1 DS1DS2:2 ME:1 MI:1 -:2  # Target \
Report Descriptor
161 fixed VALUE:16  # Track Plot Number
040 fixed RHO:16*1/128NM THETA:16*360/65536deg  # Measured Position in Polar Co-ordinates
042 fixed X:16s*1/64NM Y:16s*1/64NM  # Calculated Position in Cartesian Co-ordinates
200 fixed GSP:16*4/65536NM/s HDG:16*360/65536deg  # Calculated Track Velocity in Polar \
Co-ordinates
070 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Mode-3/A Code in Octal Representation
090 fixed V:1 G:1 HGT:14s*1/4FL  # Mode-C Code in Binary Representation
141 fixed VALUE:16*1/128s  # Truncated Time of Day
130 list VALUE:7  # Radar Plot Characteristics
131 fixed VALUE:8s*1dBm  # Received Power
120 fixed VALUE:8s*1/256NM/s  # Measured Radial Doppler Speed
170 extended CON:1 RAD:1 MAN:1 DOU:1 RDPC:1 -:1 GHO:1 | TRE:1 -:6  # Track Status
210 list VALUE:7  # Track Quality
050 fixed V:1 G:1 L:1 -:1 MODE2:12o  # Mode-2 Code in Octal Representation
080 fixed -:4 QA4:1 QA2:1 QA1:1 QB4:1 QB2:1 QB1:1 QC4:1 QC2:1 QC1:1 QD4:1 QD2:1 QD1:1  # \
Mode-3/A Code Confidence Indicator
100 fixed V:1 G:1 -:2 MODEC:12 -:4 QC1:1 QA1:1 QC2:1 QA2:1 QC4:1 QA4:1 QB1:1 QD1:1 QB2:1 QD2:1 \
QB4:1 QD4:1  # Mode-C Code and Code Confidence Indicator
060 fixed -:4 QA4:1 QA2:1 QA1:1 QB4:1 QB2:1 QB1:1 QC4:1 QC2:1 QC1:1 QD4:1 QD2:1 QD1:1  # Mode-2 \
Code Confidence Indicator
030 list VALUE:7  # Warning/Error Conditions
SP explicit  # Special Purpose Field
RFS rfs
150 fixed XA:1 -:1 XC:1 -:2 X2:1 -:2  # Presence of X-Pulse
"""
