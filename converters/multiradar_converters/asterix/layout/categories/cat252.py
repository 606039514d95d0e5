"""ASTERIX category 252, connections and services of ARTAS: edition 7.0.

The ARTAS standard of EUROCONTROL is not available; order, bits and units are those of the public
definition files of Croatia Control. Connection messages (FAMILY of item 035 is 1) have a separate
order, 7.0-connection; all others have 7.0. A block has the layout of its source; for a source that
writes both, `--edition` or the number of fitting blocks decides. Item 230 is described for two
radars.
"""

EDITIONS = ("7.0",)

_HEAD = """\
010 fixed SAC:8 SIC:8  # Server Identification Tag
015 fixed VALUE:16  # User Number
020 fixed VALUE:24*1/128s  # Time of Message
035 fixed FAMILY:4 NATURE:4  # Type of Message
"""

_AREA = """\
060 repetitive NS:1 LATDEG:7*1deg -:2 LATMIN:6*1min -:2 LATSEC:6*1s LONDEG:8*1deg EW:1 -:1 \
LONMIN:6*1min -:2 LONSEC:6*1s  # Geographical Area
"""

_LIMITS = """\
070 fixed -:2 VALUE:14s*25ft  # Lower Limit
080 fixed -:2 VALUE:14s*25ft  # Upper Limit
"""

TABLE = f"""\
{_HEAD}\
110 extended -:5 BS:1 C1:1 | C2:1 C3:1 C4:1 C5:1 -:3  # Service Identification
330 repetitive NATURE:5 CODE:11  # Service Related Report
210 extended SVR:1 USR:1 SID:1 TYP:1 TRN:1 LTU:1 TRA:1 CTP:1 TVP:1 TVC:1 TMA:1 TMC:1 ALT:1 CTF:1 \
ATS:1 | ATQ:1 MOF:1 RCD:1 RTN:1 PLA:1 RSI:1 PPP:1 MTF:1 M3A:1 FDP:1 CAL:1 PLN:1 DEP:1 DST:1 TUR:1 \
| AFT:1 COD:1 CFL:1 FLI:1 CCP:1 LMT:1 MSA:1 MSI:1 CCF:1 TPA:1 VAP:1 VAC:1 ALA:1 FLA:1 CDA:1 | \
TNA:1 MFP:1 TM2:1 ATN:1 LTN:1 3DH:1 REF:1 -:8  # Item Selector
220 fixed -:1 SCANNING:1 SCANPER:6*1s BATPER:4*1/10s UPDPER:12*1s -:2 DELAY:6*1/10s -:1 \
MAXFLOW:7*1kB/s  # Cyclical Update Characteristics
200 fixed TYP:2 DETECT:5 VALT:2 STCOR:2 TNT:1 SPI:1 ME:1 TRAF:2 FCAT:3 -:13  # Track/Flight \
Categories Selector
130 repetitive -:4 TRACK:12  # Track Number Selector
140 repetitive W1:1 W2:1 W3:1 W4:1 MODE3A:12o  # Code Family Selector
120 repetitive VALUE:56a  # Callsign Selector
150 repetitive VALUE:32a  # Departure Airport Selector
160 repetitive VALUE:32a  # Destination Airport Selector
{_AREA}\
170 repetitive VALUE:32a  # Aircraft Type Selector
190 fixed CENTRE:8 POSITION:8  # Current Control Position Selector
230 extended MSAC:8 MSIC:8 NOP:1 -:6 | BSAC:8 BSIC:8 -:7  # Radar Synchronization Characteristics
320 fixed VALUE:8*1s  # Minimal Period
310 fixed VALUE:8*1s  # Refreshment Period
240 extended TLF:1 TNB:1 TQY:1 PLN:1 M3A:1 MO2:1 COR:1 SPE:1 MOF:1 -:6  # Discrete Parameters Flags
270 fixed VALUE:8*360/16384deg  # Heading Criterion
280 fixed VALUE:8*1kt  # Speed Module Criterion
290 fixed VALUE:8*25ft  # Altitude Criterion
260 fixed VALUE:8*1/64NM  # Position Criterion
250 fixed VALUE:8*1/4%  # MOF Probability Criterion
300 fixed VALUE:8*1/8  # Factor K
255 fixed VALUE:16*375/64ft/min  # Rate of Climb/Descent Criterion
265 fixed VALUE:8*1/4deg/s  # Rate of Turn Criterion
{_LIMITS}\
135 repetitive VALUE:24  # Aircraft Address Selector
137 repetitive VALUE:48c  # Aircraft Identification Selector
350 repetitive SAC:8 SIC:8  # Sensor Selector
360 fixed SVR:1 USR:1 LMT:1 SIT:1 SST:1 TSB:1 SRB:1 SAB:1 PRB:1 PAB:1 -:6  # Sensor Item Selector
370 fixed VALUE:16*1s  # Period of Sensor Information Service
400 fixed VALUE:16*1s  # Refreshment Period of Sensor Information Service
410 fixed SSC:1 -:7  # Discrete Parameters of Sensor Information Service
420 fixed -:2 VALUE:14*1ms  # Time Stamping Criterion of Sensor Information Service
430 fixed -:5 VALUE:11*1/128NM  # SSR Range Bias Criterion of Sensor Information Service
440 fixed -:4 VALUE:20*1/1000000  # SSR Range Gain Criterion of Sensor Information Service
450 fixed VALUE:16*360/65536deg  # SSR Azimuth Bias Criterion of Sensor Information Service
460 fixed -:5 VALUE:11*1/128NM  # PR Range Bias Criterion of Sensor Information Service
470 fixed -:4 VALUE:20*1/1000000  # PR Range Gain Criterion of Sensor Information Service
480 fixed VALUE:16*360/65536deg  # PR Azimuth Bias Criterion of Sensor Information Service
"""

EDITIONS_CONNECTION = ("7.0-connection",)

TABLE_CONNECTION = f"""\
{_HEAD}\
100 repetitive NATURE:3 CODE:5  # Connection Related Report
040 fixed VALUE:64a  # Access Key
045 fixed ROLE:2 VER:6  # Role and Version
050 fixed UDI:2 UPP:1 LOW:1 FPP:1 -:3  # Default Connection Options
{_AREA}\
{_LIMITS}\
090 fixed SAC:8 SIC:8  # Preferred FPPS Identification Tag
340 fixed SF:1 -:7  # Scaling Factor
"""
