"""Contents of single records of ARTAS (categories 030, 252), decoded by hand, as in `SINGLE`."""

from support.asterix.single_records import TICK_S, TURN_DEG, bits, n, s, source

ARTAS: dict[str, tuple[int, str, list[dict[str, object]]]] = {
    "cat030ed7.0.bin": (
        30,
        "7.0",
        [
            {
                "010": source("0001"),
                "015": 0x24,
                "030": bits("-5 BS C1:", 0x04 >> 1),
                "035": {"FAMILY": 0, "NATURE": 0},
                "040": {"STTN": 1, "TRACK": 0x841},
                "070": n("6afe03", TICK_S),
                "170": {
                    "PSR": n("ff", 1 / 4),
                    "SSR": n("07", 1 / 4),
                    "AMODE": n("07", 1 / 4),
                    "CMODE": n("09", 1 / 4),
                },
                "100": {"X": s("f951", 1 / 64), "Y": s("0ebf", 1 / 64)},
                "180": {"SPEED": n("081d", 2**-14), "HEADING": n("9644", TURN_DEG)},
                "060": {"V": 0, "G": 0, "C": 0, "MODE3A": "2274"},
                "150": {"MODEC": n("05c8", 1 / 4)},
                "130": {"SRC": 1, "ALT": n("05a1", 25)},
                "080": bits("LIV CNF ADD CST TYPE3", 0x05 >> 1)
                | bits("TRM CRE SLR2 COR3", 0x0F >> 1)
                | bits("-2 FOR AMA SPI ME TDC", 0x11 >> 1)
                | bits("SF -6", 0x80 >> 1),
                "200": {"TRANS": 0, "LONGI": 0, "VERTI": 0},
                "220": 0,
                "240": 0,
                "260": source("0002"),
                "360": {"RHO": n("645a", 1 / 128), "THETA": n("9879", TURN_DEG)},
                "140": {"VAL": 0, "GC": 0, "MODEC": n("05c8", 1 / 4)},
                "340": {"V": 0, "G": 0, "L": 0, "MODE3A": "2274"},
                "020": n("6afe03", TICK_S),
                "050": [{"AUI": 0x0617CE >> 13, "STN": 0x17CE >> 1 & 0xFFF}],
            }
        ],
    ),
    "cat252ed7.0.bin": (
        252,
        "7.0",
        [
            {
                "010": source("0007"),
                "015": 0x24,
                "020": n("6afe04", TICK_S),
                "035": {"FAMILY": 3, "NATURE": 2},
                "110": bits("-5 BS C1:", 0x04 >> 1),
                "330": [{"NATURE": 0x400B >> 11, "CODE": 0x400B & 0x7FF}],
            }
        ],
    ),
}
