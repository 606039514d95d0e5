"""A recording of an operational processor: its system tracks (062) beside plots of one radar (048).

The processor writes items that are not used here, reserved expansion and special purpose fields,
and a second service; it uses the number of an ended track again.
"""

import random
from collections.abc import Iterable
from typing import Any

import numpy as np
import polars as pl

from multiradar_converters.asterix.layout.catalogue import layout_of
from support.asterix.octets import block, plot_048, record, time_of_day
from support.asterix.random_records import item_octets

#: Items that the converter does not use, and the fraction of the records that have each.
UNUSED = ("110", "120", "200", "210", "220", "270", "290", "295", "300", "390", "500", "510")
FIELDS = ("RE", "SP")
FRACTION = 0.3
#: Time after which a number is used again, s; interval of the second service, updates.
FREE_AFTER_S, SECOND_EVERY = 12.0, 3
LATENCY_S = 0.4
DATAGRAM_S = 0.3
_PROFILE = layout_of(62, "1.21").profiles[0]
_PLACE = {item.name: place for place, item in enumerate(_PROFILE, 1) if item is not None}

Record = tuple[float, int, bytes]


def system_tracks(tracks: pl.DataFrame, seed: int = 1) -> list[Record]:
    """Write `tracks.parquet` as category 062: time of day, category and octets of each record."""
    generator = random.Random(seed)
    numbers: dict[int, int] = {}
    used: dict[int, float] = {}
    ends = dict(tracks.group_by("track_id").agg(pl.col("time_s").max()).iter_rows())
    found: list[Record] = []
    for count, row in enumerate(tracks.sort("time_s").to_dicts()):
        time_s, track = row["time_s"], row["track_id"]
        if track not in numbers:
            numbers[track] = next(
                one for one in range(1, 1000) if time_s - used.get(one, -1e9) > FREE_AFTER_S
            )
        used[numbers[track]] = time_s
        items = _items(row, numbers[track], ended=time_s == ends[track])
        items += [
            (_PLACE[name], item_octets(_PROFILE[_PLACE[name] - 1], generator).hex())
            for name in (*UNUSED, *FIELDS)
            if generator.random() < FRACTION
        ]
        for service in ("01", "02")[: 1 + (count % SECOND_EVERY == 0)]:
            octets = record(*sorted([*items, (_PLACE["015"], service)]))
            found.append((time_s % 86_400, 62, octets))
    return found


def plots(measurements: pl.DataFrame) -> list[Record]:
    """Write plots of a radar as category 048."""
    return [
        (
            row["time_s"] % 86_400,
            48,
            plot_048(
                row["time_s"] % 86_400,
                source="1401",
                range_nm=row["range_m"] / 1852.0,
                azimuth_deg=row["azimuth_deg"],
                code=f"{int(row['mode_3a'], 8):04x}",
                level=f"{round(row['height_m'] / 30.48 * 4) & 0x3FFF:04x}",
                address=row["mode_s_address"],
            ),
        )
        for row in measurements.to_dicts()
    ]


def datagrams(records: Iterable[Record]) -> list[tuple[float, bytes]]:
    """Return blocks of records of one category, with the time of day of their reception."""
    found: list[tuple[float, bytes]] = []
    waiting: list[Record] = []
    for one in [*sorted(records, key=lambda one: one[:2]), (np.inf, 0, b"")]:
        if waiting and (one[1] != waiting[0][1] or one[0] - waiting[0][0] > DATAGRAM_S):
            octets = block(waiting[0][1], *(each[2] for each in waiting))
            found.append((waiting[-1][0] + LATENCY_S, octets))
            waiting = []
        waiting.append(one)
    return found


def _items(row: dict[str, Any], number: int, *, ended: bool) -> list[tuple[int, str]]:
    heading = np.radians(row["heading_deg"])
    velocity = row["speed_mps"] * np.array([np.sin(heading), np.cos(heading)])
    angles = (row["latitude_deg"], row["longitude_deg"])
    return [
        (_PLACE["010"], "14fa"),
        (_PLACE["070"], time_of_day(row["time_s"] % 86_400)),
        (_PLACE["105"], "".join(_signed(angle, 180 / 2**25, 32) for angle in angles)),
        (_PLACE["185"], "".join(_signed(part, 0.25, 16) for part in velocity)),
        (_PLACE["060"], f"{int(row['mode_3a'], 8):04x}"),
        (_PLACE["380"], "80" + row["mode_s_address"]),
        (_PLACE["040"], f"{number:04x}"),
        (_PLACE["080"], "0140" if ended else "00"),
        (_PLACE["136"], _signed(row["height_m"] / 30.48, 0.25, 16)),
    ]


def _signed(value: float, unit: float, bits: int) -> str:
    return f"{round(value / unit) & ((1 << bits) - 1):0{bits // 4}x}"
