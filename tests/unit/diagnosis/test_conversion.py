"""Diagnosis of a conversion, without a sensors file."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.conversion import (
    _count_gaps,
    _largest_rejected,
    _of_units,
    _signed,
    diagnose_conversion,
)
from multiradar.diagnosis.evidence import BEFORE_MAX, GAPS_MAX, Source
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import plots_of
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from support.inputs.mistaken import RADARS, Recording, recording

RANGE, AZIMUTH = pl.col("range_m"), pl.col("azimuth_deg")


def said_of(
    one: Recording, folder: Path, *, rejected: int = 0, dump: bool = False
) -> list[Diagnosis]:
    """Return the diagnoses of a converted recording."""
    missing = [
        pl.lit(None, kind).alias(name)
        for name, kind in MEASUREMENT_SCHEMA.items()
        if name not in one.frame.columns
    ]
    file = folder / "measurements.parquet"
    one.frame.with_columns(missing).select(MEASUREMENT_SCHEMA.names()).write_parquet(file)
    counts = {"read": 1000, "accepted": 1000 - rejected, "rejected": rejected}
    report = {
        "inputs": [{"file": "plots.txt", "counts": counts}],
        "outputs": [{"file": file.name, "rows": len(one.frame)}],
    }
    figures: dict[str, Any] = {"figures": {"files": {}}} if dump else {}
    return diagnose_conversion(file, {**report, **figures})


@pytest.mark.parametrize("positions", [False, True])
def test_a_correct_dump_has_no_diagnosis(tmp_path: Path, *, positions: bool) -> None:
    assert said_of(recording(positions=positions), tmp_path) == []


@pytest.mark.parametrize(
    ("columns", "code"),
    [
        ({"range_m": RANGE / 1e3}, "range_unit"),
        ({"range_m": RANGE / 1852.0}, "range_unit"),
        ({"range_m": RANGE / 1609.344}, "range_unit"),
        ({"azimuth_deg": (AZIMUTH / 360.0 * 4096.0).floor() % 360.0}, "positions_differ"),
        ({"azimuth_deg": AZIMUTH * np.pi / 180.0}, "azimuth_unit"),
        ({"azimuth_deg": 360.0 - AZIMUTH}, "azimuth_anticlockwise"),
        ({"range_m": AZIMUTH, "azimuth_deg": RANGE}, "columns_exchanged"),
        ({"height_m": pl.col("height_m") / 0.3048}, "height_unit"),
        ({"time_s": pl.col("time_s") + 7200.0}, "times_apart"),
    ],
)
def test_a_mistake_is_named_before_there_are_sites(
    tmp_path: Path, columns: dict[str, pl.Expr], code: str
) -> None:
    found = said_of(recording(positions=True).changed("2-10", **columns), tmp_path)
    assert [(one.sensor_id, one.code) for one in found] == [("2-10", code)]


def test_the_site_that_makes_the_plots_fit_is_the_true_one(tmp_path: Path) -> None:
    wrong = recording(positions=True).changed("2-10", range_m=RANGE / 1e3)
    latitude, longitude, _ = RADARS["2-10"][0]
    assert (
        f"for a site near {latitude:.2f}, {longitude:.2f}" in said_of(wrong, tmp_path)[0].sentence
    )


@pytest.mark.parametrize(("count", "codes"), [(0, []), (19, []), (20, ["columns_exchanged"])])
def test_units_show_in_twenty_plots(count: int, codes: list[str]) -> None:
    wrong = recording().only("2-10").changed("2-10", range_m=AZIMUTH, azimuth_deg=RANGE)
    plots = plots_of(wrong.evidence().sources["2-10"].plots()).select(np.arange(count))
    assert [one.code for one in _of_units("2-10", plots, 0.0)] == codes


def test_a_file_of_which_most_is_rejected_is_named(tmp_path: Path) -> None:
    assert said_of(recording(), tmp_path, rejected=333) == []
    found = said_of(recording(), tmp_path, rejected=400)
    assert [one.code for one in found] == ["records_rejected"]
    assert found[0].sentence.startswith("plots.txt: 40% of its 1 000 records were rejected; ")


def test_the_most_frequent_reason_of_a_rejected_file_is_quoted(tmp_path: Path) -> None:
    rows = [
        {"file": name, "line": line, "reason": f"{reason}, was '{line}'"}
        for line, (name, reason) in enumerate(
            [("plots.txt", "h: a"), *[("plots.txt", "time: b")] * 3, *[("tracks.txt", "c")] * 9], 2
        )
    ]
    lines = "".join(f"{json.dumps(one)}\n" for one in rows)
    (tmp_path / "rejects.ndjson").write_text(lines, encoding="utf-8")
    (found,) = said_of(recording(), tmp_path, rejected=400)
    assert "records were rejected, such as line 3: time: b, was '3'; rejects." in found.sentence


@pytest.mark.parametrize(("count", "named"), [(30, True), (19, False)])
def test_codes_without_their_leading_zeros_are_named(
    tmp_path: Path, count: int, *, named: bool
) -> None:
    """Regression: all plots of aircraft with codes below 1000 were missing, with status 0."""
    reason = "code: expected four octal digits, was '123' (leading zeros lost?)"
    rows = [{"file": "plots.txt", "line": line, "reason": reason} for line in range(2, 2 + count)]
    lines = "".join(f"{json.dumps(one)}\n" for one in rows)
    (tmp_path / "rejects.ndjson").write_text(lines, encoding="utf-8")
    found = said_of(recording(), tmp_path, rejected=count)
    assert [one.code for one in found] == (["codes"] if named else [])
    assert not named or "30 values of code have too few digits" in found[0].sentence


def test_a_conversion_that_wrote_no_measurement_is_named(tmp_path: Path) -> None:
    one = recording()
    found = said_of(Recording(one.frame.clear(), one.sensors), tmp_path)
    assert [said.code for said in found] == ["no_measurements"]


def test_negative_azimuths_are_named(tmp_path: Path) -> None:
    lines = [
        f'{{"reason": "azimuth: expected 0 to 360 °, was \'-{one}.25\'"}}' for one in range(2, 42)
    ]
    (tmp_path / "rejects.ndjson").write_text("\n".join(lines), encoding="utf-8")
    (found,) = said_of(recording(), tmp_path)
    assert found.code == "azimuth_signed"
    assert "40 azimuths between -41° and 0° were rejected" in found.sentence


def test_rounding_about_north_is_no_sign(tmp_path: Path) -> None:
    lines = [
        f'{{"reason": "azimuth: expected 0 to 360 °, was \'-0.0{one:02}\'"}}' for one in range(99)
    ]
    (tmp_path / "rejects.ndjson").write_text("\n".join(lines), encoding="utf-8")
    assert said_of(recording(), tmp_path) == []


def test_plots_that_a_file_holds_twice_are_named(tmp_path: Path) -> None:
    once = recording()
    again = once.frame.filter(pl.col("sensor_id") == "2-10")
    twice = replace(once, frame=pl.concat([once.frame, again]))
    assert said_of(twice, tmp_path) == []
    (found,) = said_of(twice, tmp_path, dump=True)
    assert (found.sensor_id, found.code) == ("2-10", "rows_repeated")
    assert "50% of its plots are copies of other plots" in found.sentence


@pytest.mark.parametrize(("seconds", "unit"), [(60.0, "minutes"), (3600.0, "hours")])
def test_times_of_day_in_minutes_or_hours_are_no_other_clock(
    tmp_path: Path, seconds: float, unit: str
) -> None:
    time_s = pl.col("time_s")
    of_day = time_s - time_s % 86_400.0 + time_s % 86_400.0 / seconds
    for names in (("2-10",), ("1-10", "2-10")):
        (found, *_) = said_of(recording().changed(*names, time_s=of_day), tmp_path)
        assert found.code == "time_unit"
        assert f"are probably in {unit}: " in found.sentence


# Of 1000 accepted plots, more than 2 % and 20; two outliers do not count, nor do negative ones.
@pytest.mark.parametrize(("count", "largest"), [(41, 439.0), (40, 0.0)])
def test_the_largest_of_many_rejected_azimuths_counts(count: int, largest: float) -> None:
    beyond = [439.0 - one for one in reversed(range(count - 2))]
    assert _largest_rejected([-3.0, 0.0, *beyond, 800.0, 900.0], 1000) == largest


@pytest.mark.parametrize(
    ("azimuths_deg", "found"),
    [
        ([-180.0, *[-1.0] * 19], 1),
        ([-180.1, *[-1.0] * 19], 0),
        ([-180.0, *[-1.0] * 18, -0.9], 0),
    ],
)
def test_rejected_azimuths_are_signed_within_half_a_circle(
    azimuths_deg: list[float], found: int
) -> None:
    assert len(_signed(azimuths_deg)) == found


def counted(*time_s: float) -> Source:
    source = Source()
    _count_gaps(source, pl.LazyFrame({"time_s": time_s}))
    return source


def test_gaps_of_a_minute_are_counted_and_the_longest_one_is_named() -> None:
    source = counted(300.0, 0.0, 60.0, 119.0, 119.0)
    assert (source.gap_s, source.gap_from_s) == (181.0, 119.0)
    assert source.gaps == {0.0: 60.0, 119.0: 181.0}
    # Two at 119 s, and the one a minute before.
    assert source.before == {0.0: 1, 119.0: 3}
    assert counted(*[0.0] * (BEFORE_MAX + 1), 99.0).before == {0.0: BEFORE_MAX}
    once = counted(5.0)
    assert (once.gap_s, np.isnan(once.gap_from_s), once.gaps) == (0.0, True, {})


def test_the_longest_of_many_gaps_are_retained() -> None:
    gaps_s = [100.0 + one for one in range(GAPS_MAX + 8)]
    source = counted(0.0, *np.cumsum(gaps_s))
    assert source.gap_s == gaps_s[-1]
    assert sorted(source.gaps.values()) == gaps_s[8:]
    assert source.before.keys() == source.gaps.keys()
