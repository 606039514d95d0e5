"""Long tables, which compiled loops test and translate: the same as by expressions."""

import pickle
import random
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.wire import measurements
from multiradar_converters.normalised import checks
from multiradar_converters.normalised.arrow import parse_columns
from multiradar_converters.normalised.exported import exported
from multiradar_schemas.measurements import gates
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.messages import adsb, radar, sensors
from support.inputs.odd_values import SENSORS, VALUES

LONG_NAME = "a-sensor-with-a-name-of-forty-octets.0_1"
#: The same sensors, one of which also has a long name.
NAMED = replace(SENSORS, aliases=((LONG_NAME, 0),))
KINDS = (
    radar, adsb, lambda: radar(kind="bearing"), lambda: adsb(kind="mlat"),
    lambda: radar(mode_s_address="4B12aF", callsign="swr 1 ", track_number=7),
    lambda: radar(callsign="          KLM1", mach=0.7, position_sigma_m=3.0, on_ground=True),
)  # fmt: skip


def table(seed: int, rows: int, faults: float) -> pl.DataFrame:
    """Rows of all kinds, of which a part has one other value."""
    drawn = random.Random(seed)
    found = []
    for _ in range(rows):
        row: dict[str, Any] = dict.fromkeys(MEASUREMENT_SCHEMA) | drawn.choice(KINDS)()
        if drawn.random() < faults:
            name = drawn.choice(list(MEASUREMENT_SCHEMA))
            row[name] = drawn.choice(VALUES[type(MEASUREMENT_SCHEMA[name])])
        found.append(row)
    frame = pl.DataFrame(found, schema=MEASUREMENT_SCHEMA)
    # Most recordings have few of these columns.
    optional = list(MEASUREMENT_SCHEMA)[3:]
    left_out = drawn.sample(optional, drawn.randrange(len(optional)))
    empty = [pl.lit(None, MEASUREMENT_SCHEMA[name]).alias(name) for name in left_out]
    return frame.with_columns(empty)


#: Texts at and beyond the forms of identities and names.
FORMS = (
    "0000", "7777", "8000", "7/00", "777", "77777", "7777777777777", "000000", "ffffff", "FFFFFF",
    "9AbCdE", "g00000", "00000G", "0000/0", "00000:", "@00000", "`00000", "00000", "0000000", "A",
    "A1", "KLM 12AB", "KLM12ABCD", " KLM 1", "KLM1 ", "     KLM1     ", " ", "        ", "KLM-1",
    "a/b", "a.b_c-d", "a" * 12, "a" * 13, "a" * 64, "a" * 65, "\xe9", "psr_mode_s", "bearing ",
)  # fmt: skip
VALUES_OF: dict[type[pl.DataType], tuple[Any, ...]] = {
    **VALUES,
    pl.String: (*VALUES[pl.String], *FORMS),
}
TABLES = [table(seed, 40, faults) for seed in range(60) for faults in (0.0, 0.1)]


def translated(frame: pl.DataFrame, sensors: Any) -> Any:
    batch, rejected = wire.measurement_batch(frame, sensors)
    # By content, with the types of all columns.
    return pickle.dumps(batch), rejected.index.tolist(), rejected.code, rejected.reason


def by_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "ROWS_MIN", 1)


def by_expressions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "ROWS_MIN", 10**9)
    for module in (gates, measurements):
        monkeypatch.setattr(module, "LISTED_ROWS_MAX", -1)


@pytest.mark.parametrize("sensors", [SENSORS, NAMED], ids=["short-names", "a-long-name"])
def test_a_batch_is_that_of_the_expressions(sensors: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    by_expressions(monkeypatch)
    expected = [translated(frame, sensors) for frame in TABLES]
    assert any(rejected for _, rejected, _, _ in expected)
    by_loops(monkeypatch)
    assert [translated(frame, sensors) for frame in TABLES] == expected


@pytest.mark.parametrize("name", list(MEASUREMENT_SCHEMA))
def test_each_value_is_decided_on_as_by_the_expressions(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # One in each table: if the expressions accept a row that the loops do not, they read all.
    frames = [
        pl.DataFrame([made(), made(**{name: value})], schema=MEASUREMENT_SCHEMA)
        for value in VALUES_OF[type(MEASUREMENT_SCHEMA[name])]
        for made in (radar, adsb)
    ]
    by_expressions(monkeypatch)
    expected = [(translated(frame, SENSORS), parse_columns(frame)) for frame in frames]
    by_loops(monkeypatch)
    for frame, (batch, parsed) in zip(frames, expected, strict=True):
        assert translated(frame, SENSORS) == batch
        found = parse_columns(frame)
        assert found.frame.equals(parsed.frame)
        assert found.rejected == parsed.rejected


def test_a_message_is_parsed_as_by_the_expressions(monkeypatch: pytest.MonkeyPatch) -> None:
    by_expressions(monkeypatch)
    expected = [parse_columns(frame) for frame in TABLES]
    by_loops(monkeypatch)
    for frame, other in zip(TABLES, expected, strict=True):
        parsed = parse_columns(frame)
        assert parsed.frame.equals(other.frame)
        assert parsed.rejected == other.rejected


def test_the_loops_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    frame = pl.DataFrame([radar(), adsb()] * 200, schema=MEASUREMENT_SCHEMA)
    frame = frame.with_columns(
        range_m=pl.when(pl.int_range(pl.len()) == 4).then(2e6).otherwise("range_m")
    )
    asked: list[int] = []
    original = gates.rejections

    def counted(frame: pl.DataFrame, asked_gates: Any) -> Any:
        asked.append(len(frame))
        return original(frame, asked_gates)

    for module in (measurements, checks):
        monkeypatch.setattr(module, "rejections", counted)
    _, rejected = wire.measurement_batch(frame, wire.sensor_table(sensors()))
    parse_columns(frame)
    assert rejected.index.tolist() == [4]
    assert asked == [1, 1]


def test_parts_and_pieces_of_tables_are_read_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = pl.concat(TABLES[:8], rechunk=False)
    parts = [whole[13:], whole[5:71], whole[::3], whole.filter(whole["height_m"].is_not_null())]
    by_expressions(monkeypatch)
    expected = [translated(part, SENSORS) for part in parts]
    by_loops(monkeypatch)
    assert [translated(part, SENSORS) for part in parts] == expected


@pytest.mark.parametrize("count", [1, 2, 3, 40, 300])
def test_names_are_found_in_tables_of_any_size(count: int) -> None:
    names = checks.Names({f"s{number}": number for number in range(count)})
    texts = [None, "s", *[f"s{number}" for number in range(count + 2)], "s0000000000000000001"]
    frame = pl.DataFrame({"name": texts})
    odd = np.zeros(len(texts), np.bool_)
    with exported(frame, ["name"]) as columns:
        found = names.find(columns["name"], odd)
    assert found.tolist() == [-1, -1, *range(count), -1, -1, -1]
    assert odd.tolist() == [False, True, *[False] * count, True, True, True]
