"""What is retained for a diagnosis of many sensors and of frequent reports."""

import math
import random
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis import evidence
from multiradar.diagnosis.evidence import SOURCES_MAX, SPREAD_EVERY_MAX, Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.wire.sensors import sensor_table
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import parse_sensors
from support.inputs.mistaken import recording

AIRCRAFT, SECONDS = 40, 64
SENSORS = sensor_table(parse_sensors('[[sensor]]\nid = "adsb"\nkind = "adsb"\n'))

#: Sensors, one of which has another name in a second network.
TABLE = replace(recording().table(), aliases=(("other-network-1", 0),))
NAMES = (*TABLE.ids, "other-network-1")


def reports(from_s: int, to_s: int) -> pl.DataFrame:
    """Return a report of each aircraft in each second."""
    time_s, aircraft = np.divmod(np.arange(from_s * AIRCRAFT, to_s * AIRCRAFT), AIRCRAFT)
    return pl.DataFrame(
        {
            "time_s": time_s.astype(np.float64),
            "sensor_id": "adsb",
            "kind": "adsb",
            "latitude_deg": 50.0,
            "longitude_deg": 9.0,
            "mode_s_address": pl.Series(aircraft).cast(pl.String),
        }
    )


def test_every_configured_sensor_is_distinguished_after_many_unknown_names() -> None:
    found = Evidence(recording().table())
    for number in range(SOURCES_MAX + 10):
        found.reject(f"unknown-{number}", "UNKNOWN_SENSOR")
    for name in found.sensors.ids:
        found.reject(name, "TIME_LATE")
    assert set(found.sensors.ids) <= set(found.sources)
    assert len(found.sources) <= SOURCES_MAX + 2 * len(found.sensors)


def test_frequent_reports_of_a_window_are_thinned_over_its_whole_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(evidence, "SPREAD_ROWS_MAX", AIRCRAFT * SECONDS // 8)
    found = Evidence(SENSORS, spreads_positions=True)
    for begin in range(0, SECONDS, 4):
        found.record_rows(reports(begin, begin + 4))
        assert found.sources["adsb"].read == AIRCRAFT * (begin + 4)
    kept = found.sources["adsb"].plots()
    assert len(kept) <= AIRCRAFT * SECONDS // 8
    assert kept["mode_s_address"].n_unique() == AIRCRAFT
    gaps = kept.group_by("mode_s_address").agg(pl.col("time_s").diff().max())["time_s"]
    assert gaps.max() <= SPREAD_EVERY_MAX  # type: ignore[operator]  # not empty
    assert kept["time_s"].max() >= SECONDS - SPREAD_EVERY_MAX  # type: ignore[operator]


def test_the_first_reports_are_retained_where_they_are_not_thinned() -> None:
    found = Evidence(SENSORS)
    found.record_rows(reports(0, 8))
    assert len(found.sources["adsb"].plots()) == AIRCRAFT * 8


def messages(seed: int, names: tuple[str | None, ...]) -> list[pl.DataFrame]:
    """Messages with times out of order, pauses, and some rows without time or identity."""
    drawn = random.Random(seed)
    rows = [
        {
            "time_s": drawn.choice([None, float("nan"), 1e3, drawn.uniform(0.0, 1e3)]),
            "sensor_id": drawn.choice(names),
            "kind": "radar",
            "mode_3a": drawn.choice([None, "7012"]),
            "track_number": drawn.choice([None, 5]),
        }
        for _ in range(400)
    ]
    whole = pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA)
    # Some senders have fewer columns.
    return [part if drawn.random() < 0.5 else part.drop("mach") for part in whole.iter_slices(37)]


def recorded(parts: list[pl.DataFrame]) -> dict[str, Any]:
    found = Evidence(TABLE)
    for part in parts:
        found.record_rows(part)
    sources = {name: asdict(source) for name, source in found.sources.items()}
    for source in sources.values():
        source["kept"] = pl.concat(source["kept"]).rows()
    # By content: NaN is like itself.
    return {"sources": repr(sources), "order": list(sources), "renamed": found.renamed}


@pytest.mark.parametrize("seed", range(4))
def test_sources_are_those_of_partitions(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evidence, "GATHERED_MAX", 100)
    monkeypatch.setattr(evidence, "ROWS_MAX", 60)
    parts = messages(seed, NAMES)
    found = recorded(parts)
    assert found["renamed"]["1-10"] > 0
    monkeypatch.setattr(Evidence, "_codes", lambda _self, _names: None)
    assert recorded(parts) == found


def test_other_names_are_sorted_too() -> None:
    found = recorded(messages(9, (*NAMES, None, "stranger")))
    assert {"stranger", ""} < set(found["order"])


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_diagnosis_can_be_ended_between_its_pieces(share: float) -> None:
    """A service that stops does not wait for it."""
    calls, last = 0, math.inf

    def proceed() -> None:
        nonlocal calls
        calls += 1
        if calls > last:
            raise InterruptedError

    def found() -> Evidence:
        gathered = Evidence(recording().table(), proceed=proceed)
        gathered.record_rows(recording().frame)
        return gathered

    diagnose(found())
    # Three sensors are compared in pairs, by several checks.
    assert calls > 3 * 3
    calls, last = 0, share * (calls - 1)
    with pytest.raises(InterruptedError):
        diagnose(found())
