"""ASTERIX category 030, air situation pictures: the tracks of ARTAS, and those of STR.

The ARTAS standard of EUROCONTROL is not available. Editions 6.2 and 7.0 follow public decoders:
order and lengths by goasterix (7.0), bits and units by the definition files of Croatia Control
(6.2), which have the same order. X and Y of item 100 are in 1/64 NM; if SF of item 080 is set, the
user requested 1/32 NM, and both count twice. AUI of item 050 is as in jASTERIX; the definition
files leave its last three bits unused. Item 110 has no unit there and is not converted. RE1 is the
expansion field at position 25, RE that at the end.

Edition 5.1-str is that of the French STR, by goasterix alone: the same category with another order.
Its items 050, 080, 130 and SPE differ in meaning from those of ARTAS; 130 has no unit there.
"""

EDITIONS = ("7.0", "6.2")

TABLE = """\
010 fixed SAC:8 SIC:8  # Server Identification Tag
015 fixed VALUE:16  # User Number
030 extended -:5 BS:1 C1:1 | C2:1 C3:1 C4:1 C5:1 -:3  # Service Identification
035 fixed FAMILY:4 NATURE:4  # Type of Message
040 fixed -:3 STTN:1 TRACK:12  # Track Number
070 fixed VALUE:24*1/128s  # Time of Last Update
170 fixed PSR:8*1/4s SSR:8*1/4s AMODE:8*1/4s CMODE:8*1/4s  # Track Ages
100 fixed X:16s*1/64NM Y:16s*1/64NM  # Calculated Track Position (Cartesian)
180 fixed SPEED:16*1/16384NM/s HEADING:16*360/65536deg  # Calculated Track Velocity (Polar)
181 fixed VX:16s*1/16384NM/s VY:16s*1/16384NM/s  # Calculated Track Velocity (Cartesian)
060 fixed V:1 G:1 C:1 -:1 MODE3A:12o  # Track Mode 3/A
150 fixed -:2 MODEC:14s*1/4FL  # Measured Track Mode C
130 fixed SRC:2 ALT:14s*25ft  # Calculated Track Altitude
160 fixed -:1 QNC:1 TFL:14s*1/4FL  # Calculated Track Flight Level
080 extended LIV:1 CNF:1 ADD:1 CST:1 TYPE:3 | TRM:1 CRE:1 SLR:2 COR:3 | -:2 FOR:1 AMA:1 SPI:1 \
ME:1 TDC:1 | SF:1 -:6  # ARTAS Track Status
090 fixed -:5 QUALITY:3  # ARTAS Track Quality
200 fixed TRANS:2 LONGI:2 VERTI:2 -:2  # Mode of Flight
220 fixed VALUE:16s*375/64ft/min  # Calculated Rate of Climb/Descent
240 fixed VALUE:8s*1/4deg/s  # Calculated Rate of Turn
290 fixed AMODE:8*1/4s CMODE:8*1/4s  # Plot Ages
260 fixed SAC:8 SIC:8  # Radar Identification Tag
360 fixed RHO:16*1/128NM THETA:16*360/65536deg  # Measured Position
140 fixed VAL:1 GC:1 MODEC:14s*1/4FL  # Last Measured Mode C
340 fixed V:1 G:1 L:1 -:1 MODE3A:12o  # Last Measured Mode 3/A
RE1 explicit  # Reserved Expansion Field: Mode S Ages
390 fixed SAC:8 SIC:8  # FPPS Identification Tag
400 fixed VALUE:56a  # Callsign
410 fixed VALUE:16  # PLN Number
440 fixed VALUE:32a  # Departure Airport
450 fixed VALUE:32a  # Destination Airport
435 fixed VALUE:8a  # Category of Turbulence
430 fixed VALUE:32a  # Type of Aircraft
460 repetitive -:4 MODE3A:12o  # Allocated SSR Codes
480 fixed VALUE:16*1/4FL  # Current Cleared Flight Level
420 fixed GATOAT:2 FR1FR2:2 SP:3 -:1  # Flight Category
490 fixed CENTRE:8 POSITION:8  # Current Control Position
020 fixed VALUE:24*1/128s  # Time of Message
382 fixed VALUE:24  # Aircraft Address
384 fixed VALUE:48c  # Aircraft Identification
386 fixed COM:3 STAT:3 -:2  # Communications Capability and Flight Status
110 fixed X:16 Y:16  # Estimated Accuracy of Track Position (Cartesian)
190 fixed SPEED:16*1/16384NM/s HEADING:16*360/65536deg  # Estimated Accuracy of Track Velocity \
(Polar)
191 fixed VX:16s*1/16384NM/s VY:16s*1/16384NM/s  # Estimated Accuracy of Track Velocity (Cartesian)
135 fixed VALUE:16*25ft  # Estimated Accuracy of Track Altitude
165 fixed VALUE:16*1/4FL  # Estimated Accuracy of Calculated Track Flight Level
230 fixed VALUE:16*375/64ft/min  # Estimated Accuracy of Rate of Climb/Descent
250 fixed VALUE:8*1/4deg/s  # Estimated Accuracy of Rate of Turn
210 fixed TCPROB:8*1/2% LCPROB:8*1/2% VCPROB:8*1/2%  # Mode of Flight Probabilities
120 fixed V:1 G:1 C:1 -:1 MODE2:12o  # Track Mode 2 Code
050 list AUI:11 STN:12  # ARTAS Track Number
270 fixed VALUE:16  # Local Track Number
370 fixed VALUE:16*25ft  # Measured 3-D Height
-
-
-
RE explicit  # Reserved Expansion Field
"""

EDITIONS_STR = ("5.1-str",)

TABLE_STR = """\
010 fixed SAC:8 SIC:8  # Server Identification Tag
-
050 fixed VERSION:3 NAP:2 ST:1 NS:2 -:3 NUMBER:12 -:1  # STR Track Number
020 fixed VALUE:24*1/128s  # Time of Track
080 extended LIV:1 CNF:1 MAN:1 TVA:1 TYPE:3 | MORT:1 CRE:1 SLR:2 COR:3 | DS1DS2:2 FOR:1 AMA:1 \
SPI:1 ME:1 -:1  # Track Status
060 fixed V:1 G:1 C:1 -:1 MODE3A:12o  # Track Mode 3/A
100 fixed X:16s*1/64NM Y:16s*1/64NM  # Calculated Track Position (Cartesian)
090 fixed QUALITY:7 -:1  # Track Quality
135 fixed V:1 G:1 FL:14s*1/4FL  # Calculated Track Flight Level
136 fixed V:1 G:1 FL:14s*1/4FL  # Measured Track Flight Level
181 fixed VX:16s*1/16384NM/s VY:16s*1/16384NM/s  # Calculated Track Velocity (Cartesian)
200 fixed TRANS:2 LONGI:2 VERTI:2 -:2  # Mode of Flight
220 fixed VALUE:16s*375/64ft/min  # Calculated Rate of Climb/Descent
SPE extended SY:5 M:1 S:1 | O19:1 O18:1 O17:1 O16:1 O15:1 O14:1 O13:1 | O12:1 O11:1 O10:1 O9:1 \
O8:1 O7:1 O6:1 | O5:1 O4:1 O3:1 O2:1 O1:1 R:1 C:1  # Special Marks
260 fixed SAC:8 SIC:8  # Radar Identification Tag
400 fixed VALUE:56a  # Callsign
410 fixed VALUE:16  # PLN Number
430 fixed VALUE:32a  # Type of Aircraft
435 fixed VALUE:8a  # Category of Turbulence
440 fixed VALUE:32a  # Departure Airport
450 fixed VALUE:32a  # Destination Airport
130 fixed QNC:1 ALT:15  # Calculated Track Altitude
382 fixed VALUE:24  # Aircraft Address
384 fixed VALUE:48c  # Aircraft Identification
"""
