"""Faults of measurements and sensors."""

import json
import random
from collections.abc import Callable

from support.simulation import traffic
from support.simulation.process import TRACKING
from support.simulation.traffic import SITES, Message, Occurred, Row
from support.simulation.world import World

_EVERY = (*SITES, traffic.ADSB)
_OVER_HTTP = {"41-10": "alpha", "41-20": "bravo", traffic.ADSB: "charlie"}


def window(drawn: random.Random) -> tuple[float, float]:
    """Draw an interval in which a fault holds, s."""
    begin_s = drawn.uniform(2.0, 9.0)
    return begin_s, begin_s + drawn.uniform(2.0, 7.0)


def _radar(drawn: random.Random) -> str:
    return drawn.choice(tuple(SITES))


def _all(change: Callable[[Row], Row], chance: float = 1.0) -> Callable[..., None]:
    # A change of the rows of one sensor in a window, each with a probability.
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        own = random.Random(drawn.random())

        def maybe(row: Row) -> list[Row]:
            return [change(dict(row))] if own.random() < chance else [row]

        # As text: Arrow has columns of one type.
        world.change(drawn.choice(("41-10", "41-20")), window(drawn), maybe, occurred)

    return arm


def _with(**values: object) -> Callable[[Row], Row]:
    return lambda row: row | values


def _shifted(shift_s: float) -> Callable[[Row], Row]:
    return lambda row: row | {"time_s": row["time_s"] + shift_s}


def _clock(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A clock jumps, runs fast or slow, or stands still."""
    begin_s, end_s = window(drawn)
    kind = drawn.choice(("jump", "rate", "frozen"))
    jump_s = drawn.choice((-86_400.0, -60.0, -10.0, -1.0, 1.0, 10.0, 59.0, 86_400.0))
    rate = drawn.uniform(-0.5, 0.5)

    def change(row: Row) -> list[Row]:
        since_s = row["time_s"] - traffic.START_S - begin_s
        shift_s = {"jump": jump_s, "rate": rate * since_s, "frozen": -since_s}[kind]
        return [row | {"time_s": round(row["time_s"] + shift_s, 3)}]

    world.change(drawn.choice(_EVERY), (begin_s, end_s), change, occurred)


def _duplicates(world: World, drawn: random.Random, occurred: Occurred) -> None:
    world.change(_radar(drawn), window(drawn), lambda row: [row, dict(row)], occurred)


def _shuffled(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """Messages within the reorder window arrive in any order."""
    sender = world.senders[drawn.choice(tuple(_OVER_HTTP.values()))]
    sender.outstanding_max, sender.delay_s = 4, 3.7
    sender.effects["outstanding_max"] = occurred


def _late(world: World, drawn: random.Random, occurred: Occurred) -> None:
    sender = world.senders[drawn.choice(tuple(_OVER_HTTP.values()))]
    begin_s, end_s = window(drawn)

    def late(message: Message) -> None:
        if message.acknowledged_s - message.due_s > TRACKING.reorder_horizon_s:
            occurred()

    def cut(value: Callable[[Message], None] | None) -> Callable[[], None]:
        return lambda: setattr(sender, "cut", value)

    world.during(begin_s, end_s + 6.0, cut(late), cut(None))


def _silent(world: World, drawn: random.Random, occurred: Occurred) -> None:
    for sensor in drawn.sample(_EVERY, drawn.randint(1, 4)):
        world.change(sensor, window(drawn), lambda row: [], occurred)


def _bias(world: World, drawn: random.Random, occurred: Occurred) -> None:
    metres, degrees = drawn.uniform(-2000.0, 2000.0), drawn.uniform(-2.0, 2.0)
    world.change(
        _radar(drawn), window(drawn),
        lambda row: [
            row if isinstance(row["range_m"], str) else row | {
                "range_m": abs(row["range_m"] + metres),
                "azimuth_deg": (row["azimuth_deg"] + degrees) % 360.0,
            }
        ],
        occurred,
    )  # fmt: skip


def _stuck(world: World, drawn: random.Random, occurred: Occurred) -> None:
    world.change(_radar(drawn), window(drawn), lambda row: [row | {"azimuth_deg": 90.0}], occurred)


def _storm(world: World, drawn: random.Random, occurred: Occurred) -> None:
    """A sensor delivers many times what it can, with new identities."""
    numbers = iter(range(1000, 100_000))

    def change(row: Row) -> list[Row]:
        azimuth = drawn.uniform(0.0, 360.0)
        return [
            row,
            *(
                row | traffic.identity(next(numbers)) | {"azimuth_deg": (azimuth + 3 * k) % 360.0}
                for k in range(20)
            ),
        ]

    begin_s, _ = window(drawn)
    sensor = drawn.choice(("41-10", "41-20"))
    world.change(sensor, (begin_s, begin_s + 4.0), change, occurred)


def _same_identity(world: World, drawn: random.Random, occurred: Occurred) -> None:
    code = drawn.choice(("0000", "7777", "1234"))
    world.change(
        _radar(drawn), window(drawn),
        lambda row: [row | {"mode_3a": code, "mode_s_address": "4b0001"}], occurred,
    )  # fmt: skip


def _ghosts(world: World, drawn: random.Random, occurred: Occurred) -> None:
    def change(row: Row) -> list[Row]:
        ghost = row | {"mode_s_address": "abcdef", "latitude_deg": row["latitude_deg"] + 0.5}
        return [row, ghost]

    world.change(traffic.ADSB, window(drawn), change, occurred)


def _sites(name: str) -> Callable[[World, random.Random, Occurred], None]:
    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        world.use_table(name, occurred)

    return arm


def _hostile_body(*bodies: bytes) -> Callable[..., None]:
    """A message that no sender in order sends; whatever is answered has a code."""

    def arm(world: World, drawn: random.Random, occurred: Occurred) -> None:
        for number in range(3):
            due_s = drawn.uniform(1.0, 14.0)
            octets = drawn.choice(bodies)
            key = f"hostile {octets[:8].hex()} {number}"
            form = drawn.choice(["application/json", "application/x-ndjson"])
            world.send(Message("any", key, form, octets, [], due_s, "any"), occurred)

    return arm


def _wrong_encoding(world: World, drawn: random.Random, occurred: Occurred) -> None:
    rows = traffic.body("application/json", [_some_row()])
    texts = (
        b"\xef\xbb\xbf" + rows, rows.decode().encode("utf-16"), rows.replace(b"41-10", b"41\x0010"),
        rows.replace(b"41-10", b"\xc0\xad"), rows.replace(b"1.0", b"\xd9\xa1"),
    )  # fmt: skip
    _hostile_body(*texts)(world, drawn, occurred)


def _some_row() -> Row:
    return {
        "time_s": traffic.START_S + 1.0, "sensor_id": "41-10", "kind": "radar", "range_m": 80_000.0,
        "azimuth_deg": 10.0, **traffic.identity(50),
    }  # fmt: skip


_DEEP = b"[" * 50_000
_NESTED = b"[" * 1500 + b"]" * 1500
_WIDE = json.dumps([{f"k{n}": n for n in range(3000)}]).encode()
_GIANT = b'[{"time_s": 1' + b"0" * 5000 + b"}]"
_TWICE = b'[{"time_s": 1, "time_s": 2}]'
_LONE = b'[{"time_s": 1, "sensor_id": "\\ud800"}]'
_TRAVERSAL = json.dumps(
    [_some_row() | {"sensor_id": name} for name in ("../../etc", "=cmd()", "a\r\nSet-Cookie: b")]
).encode()
_COLUMNS = json.dumps([{"zeit": 1.0, "rho": 5.0}, {"time_s": 1.0, "range_ft": 3.0}]).encode()
_CUT = traffic.body("application/json", [_some_row(), _some_row()])[:-40]

FAULTS = (
    (1, "field that is no number", _all(_with(range_m="wide"), 0.3)),
    (2, "message cut within a record", _hostile_body(_CUT, _CUT[:60], _CUT[:-20])),
    (3, "wrong encoding", _wrong_encoding),
    (4, "wrong columns and units", _hostile_body(_COLUMNS)),
    (5, "plots twice", _duplicates),
    (6, "messages out of order", _shuffled),
    (7, "late messages", _late),
    (8, "clock of a sensor", _clock),
    (9, "number beyond all bounds", _all(_with(height_m=1e999), 0.3)),
    (10, "implausible values", _all(_with(height_m=70_000.0, azimuth_deg=361.0), 0.3)),
    (10, "beyond the instrumented range", _all(_with(range_m=9e6), 0.3)),
    (11, "two radars at one site", _sites("together")),
    (12, "unknown sensor", _all(_with(sensor_id="99-99"), 0.5)),
    (13, "wrong site of a radar", _sites("shifted")),
    (14, "silent sensors", _silent),
    (15, "bias jumps", _bias),
    (16, "azimuth stands still", _stuck),
    (16, "data of yesterday", _all(_shifted(-86_400.0))),
    (17, "storm of new identities", _storm),
    (18, "one identity of all aircraft", _same_identity),
    (19, "ADS-B ghosts", _ghosts),
    (37, "deep and wide JSON", _hostile_body(_DEEP, _NESTED, _WIDE, _GIANT, _TWICE, _LONE)),
    (40, "names that are paths and formulas", _hostile_body(_TRAVERSAL)),
)
