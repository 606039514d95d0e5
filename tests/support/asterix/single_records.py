"""Contents of single records from other projects, decoded by hand; the records are not included.

Octets of the record, times the value of the last bit that the standard of that category and
edition prints.
"""

TURN_DEG = 360 / 65536
FINE_DEG = 180 / 2**25
TICK_S = 1 / 128
VELOCITY = 2**-14


def n(digits: str, last_bit: float = 1) -> float:
    return int(digits, 16) * last_bit


def s(digits: str, last_bit: float = 1) -> float:
    raw = int(digits, 16)
    return (raw - (1 << 4 * len(digits)) * (raw >> (4 * len(digits) - 1))) * last_bit


def bits(names: str, octet: int, width: int = 7) -> dict[str, int]:
    """Name the bits before FX, from the first; `-` is spare."""
    values, place = {}, width
    for word in names.split():
        # `A3` has three bits, `A3:` is a name.
        if ":" in word or word[-1] not in "23456":
            name, _, given = word.partition(":")
            count = int(given or 1)
        else:
            name, count = word[:-1], int(word[-1])
        place -= count
        if name != "-":
            values[name] = octet >> place & ((1 << count) - 1)
    return values


def source(digits: str) -> dict[str, int]:
    return {"SAC": int(digits[:2], 16), "SIC": int(digits[2:], 16)}


CODE = {"V": 0, "G": 0, "L": 0}
BIT_NAMES = " ".join(f"BIT{k}:" for k in range(1, 9))
DESCRIPTOR_048 = "TYP3 SIM RDP SPI RAB"
DESCRIPTOR_048_1 = "TST ERR XPP ME MI FOEFRI2"

SINGLE: dict[str, tuple[int, str, list[dict[str, object]]]] = {
    "cat001ed1.1.bin": (
        1,
        "1.1",
        [
            {
                "010": source("0001"),
                "020": bits("TYP SIM SSRPSR2 ANT SPI RAB", 0x20 >> 1),
                "040": {"RHO": n("3fb8", 1 / 128), "THETA": n("b67c", TURN_DEG)},
                "070": CODE | {"MODE3A": "5543"},
                "090": {"V": 0, "G": 0, "HGT": n("05f0", 1 / 4)},
                "130": [0x60, 0x3C, 0x60],
                "141": n("6eb7", TICK_S),
            }
        ],
    ),
    "cat002ed1.0.bin": (
        2,
        "1.0",
        [{"010": source("0001"), "000": 1, "030": n("416eb5", TICK_S), "050": [0x49, 0x01]}],
    ),
    "cat010ed0.24_sensis.bin": (
        10,
        "0.24",
        [
            {
                "010": source("0000"),
                "000": 1,
                "020": bits("TYP3 DCR CHN GBS CRT", 0x23 >> 1)
                | bits("SIM TST RAB LOP2 TOT2", 0)
                | {"SPI": 0},
                "140": n("a4383e", TICK_S),
                "041": {"LAT": n("123875f5", 180 / 2**31), "LON": n("0fc4ed20", 180 / 2**31)},
                "042": {"X": -1423, "Y": 1368},
                "202": {"VX": -8, "VY": 1},
                "161": {"TRK": 922},
                "170": bits("CNF TRE CST2 MAH TCC STH", 0x02 >> 1),
                "220": 0x474CA1,
                "091": 0,
                "500": {"DEVX": 2.5, "DEVY": 3.25, "COVXY": -1},
            }
        ],
    ),
    "cat010ed0.31.bin": (
        10,
        "0.31",
        [
            {
                "010": source("0001"),
                "000": 1,
                "020": bits("TYP3 DCR CHN GBS CRT", 0x61 >> 1) | bits("SIM TST RAB LOP2 TOT2", 0),
                "140": n("303a92", TICK_S),
                "040": {"RHO": n("0634"), "TH": n("86c3", TURN_DEG)},
                "042": {"X": s("fef5"), "Y": s("f9e2")},
                "200": {"GSP": n("0004", VELOCITY), "TRA": n("be10", TURN_DEG)},
                "202": {"VX": -0.5, "VY": 0},
                "161": {"TRK": 4},
                "170": bits("CNF TRE CST2 MAH TCC STH", 0x03 >> 1)
                | bits("TOM2 DOU3 MRS2", 0xC1 >> 1)
                | {"GHO": 0},
                "270": {"LENGTH": 27, "ORIENTATION": 95 * 360 / 128, "WIDTH": 40},
                "210": {"AX": -1, "AY": -0.25},
            }
        ],
    ),
    "cat019ed1.3.bin": (
        19,
        "1.3",
        [
            {
                "010": source("0003"),
                "000": 2,
                "140": n("416f85", TICK_S),
                "550": bits("NOGO2 OVL TSV TTF", 0, 5),
                "551": bits("TP1A TP1B TP2A TP2B TP3A TP3B TP4A TP4B", 0xD0, 8),
                "552": [
                    {"RSI": k, "RS1090": 1, "TX1030": 1, "TX1090": 0, "RSS": 1, "RSO": 1}
                    for k in range(1, 17)
                ],
                "600": {"LAT": n("10e38e39", 180 / 2**30), "LON": n("04fa4fa5", 180 / 2**30)},
                "610": 0,
                "620": 0,
            }
        ],
    ),
    "cat020ed1.5.bin": (
        20,
        "1.5",
        [
            {
                "010": source("0002"),
                "020": bits("SSR MS HF VDL4: UAT DME OT", 0x41 >> 1)
                | bits("RAB SPI CHN GBS CRT SIM TST", 0),
                "140": n("416f5b", TICK_S),
                "041": {"LAT": n("008832e5", FINE_DEG), "LON": n("002e6c4a", FINE_DEG)},
                "042": {"X": s("054bb3", 0.5), "Y": s("01606a", 0.5)},
                "161": {"TRN": 0xDC8},
                "170": bits("CNF TRE CST CDM2 MAH STH", 0x18 >> 1),
                "070": {"V": 0, "G": 0, "L": 1, "MODE3A": "7000"},
                "202": {"VX": s("ffc9", 0.25), "VY": s("ffdb", 0.25)},
                "090": {"V": 0, "G": 0, "FL": n("002d", 0.25)},
                "220": 0x02442F,
                "210": {"AX": 0, "AY": 0},
                "400": [
                    bits(BIT_NAMES, octet, 8)
                    for octet in bytes.fromhex("00000000000000000000100000200022")
                ],
                "250": [
                    {"BDSDATA": 0x10000000A00000, "BDS1": 1, "BDS2": 0},
                    {"BDSDATA": 0, "BDS1": 1, "BDS2": 7},
                ],
                "230": bits("COM3 STAT3 CASEVN2 MSSC ARC AIC B1A: B1B4", 0x2040, 16),
                "RE": "80d00012000ffff10089007cff8600350053ffc1",
            }
        ],
    ),
    "cat021ed0.26.bin": (
        21,
        "0.26",
        [
            {
                "010": source("0005"),
                "040": bits("DCR GBS SIM TST RAB SAA SPI - ATP3 ARC2", 0x4030 >> 3, 13),
                "030": n("1c293e", TICK_S),
                "130": {"LAT": n("006e4cc9", FINE_DEG), "LON": s("ffe606d6", FINE_DEG)},
                "080": 0x496C2E,
                "090": {"AC": 0, "MN": 0, "DC": 0, "PA": 8 - 16},
                "210": bits("DTI MDS UAT VDL OTR", 0x08, 5),
                "170": "FM012",
                "200": 0,
                "020": 0x15,
            }
        ],
    ),
    "cat021ed2.1.bin": (
        21,
        "2.1",
        [
            {
                "010": source("0003"),
                "040": bits("ATP3 ARC2 RC RAB", 0x01 >> 1)
                | bits("DCR GBS SIM TST SAA CL2", 0x08 >> 1),
                "161": {"TRNUM": 0x55F},
                "015": 0,
                "130": {"LAT": n("214fba", 180 / 2**23), "LON": n("08bee1", 180 / 2**23)},
                "080": 0x1A4B65,
                "073": n("416f71", TICK_S),
                "075": n("416f3c", TICK_S),
                "140": n("15b8", 6.25),
                "090": {"NUCRNACV": 0, "NUCPNIC": 7},
                "210": bits("VNS VN3 LTT3", 0x02),
                "070": {"MODE3A": "7106"},
                "145": n("0578", 0.25),
                "200": {"ICF": 0, "LNAV": 0, "ME": 0, "PS": 0, "SS": 0},
                "077": n("416f91", TICK_S),
                "170": "EZS14ZH",
                "016": n("04", 0.5),
            }
        ],
    ),
    "cat034ed1.26.bin": (
        34,
        "1.26",
        [
            {
                "010": source("0002"),
                "000": 2,
                "030": n("416dec", TICK_S),
                "020": n("40", 360 / 256),
                "050": {
                    "COM": bits("NOGO RDPC RDPR OVLRDP OVLXMT MSC TSV", 0x40 >> 1),
                    "PSR": bits("ANT CHAB2 OVL MSC", 0x60 >> 3, 5),
                    "MDS": bits("ANT CHAB2 OVLSUR MSC SCF DLF OVLSCF OVLDLF", 0x4400 >> 7, 9),
                },
                "060": {
                    "COM": {"REDRDP": 0, "REDXMT": 0},
                    "PSR": {"POL": 0, "REDRAD": 0, "STC": 0},
                    "MDS": bits("REDRAD3 CLU", 0x10 >> 4, 4),
                },
            }
        ],
    ),
    "cat034.raw": (
        34,
        "1.27",
        [
            {
                "010": source("190e"),
                "000": 2,
                "030": n("3a692b", TICK_S),
                "020": n("40", 360 / 256),
                "050": {
                    "COM": bits("NOGO RDPC RDPR OVLRDP OVLXMT MSC TSV", 0x40 >> 1),
                    "SSR": bits("ANT CHAB2 OVL MSC", 0x40 >> 3, 5),
                },
                "060": {"COM": {"REDRDP": 0, "REDXMT": 0}},
            }
        ],
    ),
    "cat048.raw": (
        48,
        "1.21",
        [
            {
                "010": source("19c9"),
                "140": n("356d4d", TICK_S),
                "020": bits(DESCRIPTOR_048, 0xA0 >> 1),
                "040": {"RHO": n("c5af", 1 / 256), "THETA": n("f1e0", TURN_DEG)},
                "070": {**CODE, "MODE3A": "1000"},
                "090": {"V": 0, "G": 0, "FL": n("0528", 0.25)},
                "220": 0x3C660C,
                "240": "DLH65A",
                "250": [{"MBDATA": 0xC0780031BC0000, "BDS1": 4, "BDS2": 0}],
                "161": {"TRN": 0xDEB},
                "200": {"GSP": n("07b9", VELOCITY), "HDG": n("582e", TURN_DEG)},
                "170": bits("CNF RAD2 DOU MAH CDM2", 0x41 >> 1)
                | bits("TRE GHO SUP TCC", 0x00 >> 4, 4),
                "230": bits("COM3 STAT3 SI - MSSC ARC AIC B1A: B1B4", 0x20F5, 16),
            }
        ],
    ),
    "cat048ed1.15.bin": (
        48,
        "1.15",
        [
            {
                "010": source("0001"),
                "140": n("416deb", TICK_S),
                "020": bits(DESCRIPTOR_048, 0xA8 >> 1),
                "040": {"RHO": n("49ec", 1 / 256), "THETA": n("3fc4", TURN_DEG)},
                "070": {"V": 0, "G": 0, "L": 1, "MODE3A": "0470"},
                "090": {"V": 0, "G": 0, "FL": n("05c8", 0.25)},
                "130": {"SAM": s("c1")},
                "220": 0xAB4CBD,
                "240": "RYR5XW",
                "250": [
                    {"MBDATA": 0x8BD9EB2FBFE400, "BDS1": 6, "BDS2": 0},
                    {"MBDATA": 0x80919F39A004DD, "BDS1": 5, "BDS2": 0},
                    {"MBDATA": 0xC8480030A80000, "BDS1": 4, "BDS2": 0},
                ],
                "161": {"TRN": 0x397},
                "200": {"GSP": n("083c", VELOCITY), "HDG": n("1730", TURN_DEG)},
                "170": bits("CNF RAD2 DOU MAH CDM2", 0x40 >> 1),
                "230": bits("COM3 STAT3 SI - MSSC ARC AIC B1A: B1B4", 0x20FD, 16),
            }
        ],
    ),
    "cat062ed1.16.bin": (
        62,
        "1.16",
        [
            {
                "010": source("0005"),
                "015": 0x15,
                "070": n("70889d", TICK_S),
                "105": {"LAT": n("0063f32e", FINE_DEG), "LON": s("ffdd64f6", FINE_DEG)},
                "100": {"X": s("f79302", 0.5), "Y": s("f3da58", 0.5)},
                "185": {"VX": s("01fd", 0.25), "VY": s("02d5", 0.25)},
                "210": {"AX": 0, "AY": 0},
                "060": {"V": 0, "G": 0, "CH": 0, "MODE3A": "6204"},
                "040": 0x159D,
                "080": bits("MON SPI MRH SRC3 CNF", 0x19 >> 1)
                | bits("SIM TSE TSB FPC AFF STP KOS", 0x03 >> 1)
                | bits("AMA MD4:2 ME MI MD5:2", 0x01 >> 1)
                | bits("CST PSR SSR MDS ADS SUC AAC", 0x58 >> 1),
                "290": {"PSR": 63.75, "SSR": 9.0, "MDS": 63.75},
                "136": n("05f0", 0.25),
                "130": n("15c6", 6.25),
                "135": {"QNH": 0, "CTB": n("05f0", 0.25)},
                "220": 0,
                "510": [{"IDENT": 6, "TRACK": 0x1BBE >> 1}],
                "340": {
                    "SID": source("0003"),
                    "MDC": {"V": 0, "G": 0, "LMC": n("05f0", 0.25)},
                    "MDA": {**CODE, "MODE3A": "6204"},
                },
            }
        ],
    ),
    "cat063ed1.0.bin": (
        63,
        "1.0",
        [
            {
                "010": source("0005"),
                "015": 0xC1,
                "030": n("4172e6", TICK_S),
                "050": source("0001"),
                "060": bits("CON2 PSR SSR MDS ADS MLT", 0),
                "070": s("ffcb"),
                "080": {"SRG": n("000b", 1e-5), "SRB": 0},
                "081": s("ffff", TURN_DEG),
                "090": {"PRG": 1e-5, "PRB": 1 / 128},
                "091": s("fffe", TURN_DEG),
                "092": 0,
            }
        ],
    ),
    "cat065ed1.3.bin": (
        65,
        "1.3",
        [{"010": source("0005"), "000": 2, "015": 0xC1, "030": n("416f26", TICK_S), "020": 0}],
    ),
    "cat247ed1.2.bin": (
        247,
        "1.2",
        [
            {
                "010": source("0001"),
                "015": 1,
                "140": n("1c2fbb", TICK_S),
                "550": [
                    {"CAT": 21, "MAIN": 2, "SUB": 1},
                    {"CAT": 23, "MAIN": 1, "SUB": 2},
                    {"CAT": 247, "MAIN": 1, "SUB": 2},
                ],
            }
        ],
    ),
}

SINGLE["cat048ed1.23.bin"] = (
    48,
    "1.23",
    [
        {
            **SINGLE["cat048ed1.15.bin"][2][0],
            "020": bits(DESCRIPTOR_048, 0xA9 >> 1) | bits(DESCRIPTOR_048_1, 0x48 >> 1),
            "040": {"RHO": n("ffff", 1 / 256), "THETA": n("3fc4", TURN_DEG)},
            "RE": "08010100",
        }
    ],
)

SINGLE["cat004ed1.4.bin"] = (
    4,
    "1.4",
    [
        {
            "010": source("0001"),
            "000": 1,
            "020": n("058680", TICK_S),
            "060": bits("MRVA RAMLD RAMHD MSAW APW CLAM STCA", 0x0E >> 1),
        },
        {"010": source("0001"), "000": 6, "020": n("8a0500", TICK_S), "040": 0x3C88, "030": 0x0BD3},
        {
            "010": source("0001"),
            "000": 7,
            "020": n("8a0100", TICK_S),
            "040": 0x3C89,
            "045": {"AREA_EP": 0, "AREA_VAL": 0, "STAT": 3},
            "030": 0x0C3A,
            "120": {},
            "035": 0x0971,
        },
    ],
)

AGES = {"TRD": 13, "QI": 13, "MAM": 13}
AGES_2 = {"TRD": 10, "QI": 10, "MAM": 10, "TI2": 255}

SINGLE["cat21_re.ast"] = (
    21,
    "2.1",
    [
        {
            "010": source("0001"),
            "040": bits("ATP3 ARC2 RC RAB", 0) | bits("DCR GBS SIM TST SAA CL2", 0x40 >> 1),
            "130": {"LAT": n("2bb7" + latitude, 180 / 2**23), "LON": s(longitude, 180 / 2**23)},
            "080": address,
            "073": n(received, TICK_S),
            "074": {"FSI": 0, "TOMRP": n(fraction, 2**-30)},
            "090": {"NUCRNACV": 0, "NUCPNIC": 0},
            "210": bits("VNS VN3 LTT3", 0x02),
            "020": emitter,
            "016": n("08", 0.5),
            "132": s(power),
            "295": {name: age / 10 for name, age in ages.items()},
            "RE": expansion,
        }
        for latitude, longitude, address, received, fraction, emitter, power, ages, expansion in (
            ("3e", "fa65ba", 1, "384176", "3adab9f5", 0, "cb", AGES, "08f00162"),
            ("3a", "fa65b3", 2, "384195", "0a485a0c", 21, "ad", AGES_2, "0870f140"),
        )
    ],
)

SINGLE["cat062ed1.12.bin"] = (
    62,
    "1.12",
    [
        {
            "010": source("0004"),
            "015": 0xE1,
            "070": n("416f40", TICK_S),
            "105": {"LAT": n("008152c4", FINE_DEG), "LON": n("00314d24", FINE_DEG)},
            "100": {"X": s("07f46a", 0.5), "Y": s("f943b1", 0.5)},
            "185": {"VX": s("033e", 0.25), "VY": s("fe1e", 0.25)},
            "210": {"AX": 0, "AY": 0},
            "060": {"V": 0, "G": 0, "CH": 0, "MODE3A": "7621"},
            "380": {
                "ADR": 0x663CA6,
                "ID": "DLH9CK",
                "MHG": n("5540", TURN_DEG),
                "FSS": {"MV": 0, "AH": 0, "AM": 0, "ALT": 0x578 * 25},
                "BVR": s("fffb", 6.25),
                "IAR": 0x10A,
                "MAC": 0x62 * 0.008,
            },
            "040": 0x13DE,
            "080": bits("MON SPI MRH SRC3 CNF", 0x0D >> 1)
            | bits("SIM TSE TSB FPC AFF STP KOS", 0x13 >> 1)
            | bits("AMA MD4:2 ME MI MD5:2", 0x01 >> 1)
            | bits("CST PSR SSR MDS ADS SUC AAC", 0x48 >> 1),
            "290": {"PSR": 63.75, "SSR": 2.0, "MDS": 2.0, "ES": 63.75, "MLT": 63.75},
            "200": {"TRANS": 0, "LONG": 0, "VERT": 0, "ADF": 0},
            "295": dict.fromkeys(("MFL", "MDA", "MHG", "FSS", "BVR", "IAR", "MAC"), 2.0),
            "136": n("0577", 0.25),
            "135": {"QNH": 0, "CTB": n("0577", 0.25)},
            "220": 0,
            "390": {
                "TAG": source("0000"),
                "CS": "DLH9CK",
                "IFI": {"TYP": 1, "NBR": 0x3C53985},
                "FCT": bits("GATOAT2 FR1FR2:2 RVSM2 HPR", 0x44 >> 1),
                "TAC": "A320",
                "WTC": "M",
                "DEP": "EDDF",
                "DST": "LBSF",
                "CFL": n("0578", 0.25),
            },
            "500": {
                "APC": {"X": n("0050", 0.5), "Y": n("007e", 0.5)},
                "APW": {"LAT": n("0069", FINE_DEG), "LON": n("005f", FINE_DEG)},
                "AGA": n("ff", 6.25),
                "ABA": n("01", 0.25),
                "ATV": {"X": n("0b", 0.25), "Y": n("13", 0.25)},
                "AA": {"X": n("02", 0.25), "Y": n("03", 0.25)},
                "ARC": n("10", 6.25),
            },
            "340": {
                "SID": source("0001"),
                "POS": {"RHO": n("7e75", 1 / 256), "THETA": n("5b07", TURN_DEG)},
                "MDC": {"V": 0, "G": 0, "LMC": n("0577", 0.25)},
                "MDA": {"V": 0, "G": 0, "L": 1, "MODE3A": "7621"},
                "TYP": {"TYP": 5, "SIM": 0, "RAB": 0, "TST": 0},
            },
        }
    ],
)
