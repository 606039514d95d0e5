"""An error of a site needs enough pairs of enough aircraft."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.cross_sensor import site_errors
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.effects import CLOCK, GAIN, SCALE, SHIFT, SiteError
from multiradar.diagnosis.cross_sensor.site_errors import (
    AIRCRAFT_MIN,
    FEW_AIRCRAFT_MIN,
    PAIRS_MIN,
    JointFit,
)
from multiradar.estimation.measurement.kinds import KIND_POSITION
from support.inputs.mistaken import METRES_PER_DEGREE, RADARS, recording


@pytest.mark.parametrize(
    ("count", "aircraft", "left", "found"),
    [
        (PAIRS_MIN, AIRCRAFT_MIN, 1.0, True),
        (PAIRS_MIN - 1, AIRCRAFT_MIN, 1.0, False),
        (PAIRS_MIN, AIRCRAFT_MIN - 1, 1.0, False),
        # Of few aircraft, it must explain most of the residuals.
        (PAIRS_MIN, FEW_AIRCRAFT_MIN, 0.2, True),
        (PAIRS_MIN, FEW_AIRCRAFT_MIN - 1, 0.2, False),
    ],
)
def test_an_error_is_found_from_a_number_of_pairs_and_of_aircraft_on(
    count: int, aircraft: int, left: float, *, found: bool
) -> None:
    # As many pairs again of two other radars, of other aircraft: they say nothing of this one.
    beside = np.arange(2 * count) >= count
    pairs = SimpleNamespace(source=np.full(2 * count, 1), name=np.arange(2 * count) % aircraft)
    pairs.name[beside] += aircraft
    rows: Any = SimpleNamespace(own=np.where(beside, 2, 0), pairs=pairs)
    fit: Any = SimpleNamespace(
        used=np.ones(2 * count, np.bool_), solution=np.full(2, 1e6), residual_m=np.ones(2 * count)
    )
    after: Any = SimpleNamespace(**vars(fit) | {"residual_m": np.full(2 * count, left)})
    equations: Any = SimpleNamespace(clustered=lambda *_: np.eye(2))
    error = site_errors._error(rows, (SHIFT, (0,)), fit, after, equations)
    assert (error is not None) == found


def test_errors_that_explain_nothing_are_not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = object.__new__(JointFit)
    fits._basis, fits._rows = np.zeros((8, 2, 0)), None
    fits._comparison = SimpleNamespace(proceed=lambda: None)  # type: ignore[assignment]
    rows: Any = SimpleNamespace(apart=np.ones((8, 2)))
    error: Any = SimpleNamespace(radars=(0,))
    monkeypatch.setattr(site_errors, "_error_columns", lambda *_: np.ones((8, 2, 1)))
    monkeypatch.setattr(site_errors, "_error", lambda *_: error)
    for costs, found in (([3.0, 1.0], [(error,)]), ([1.0, 3.0], [])):
        # Of no error, and of the error.
        given = iter(costs)
        monkeypatch.setattr(site_errors, "_cost", lambda *_, given=given: next(given))
        assert fits._search(rows, [(SHIFT, (0,))], {}) == found


def test_what_reports_positions_may_be_shifted_as_the_site_of_a_radar(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Radars 0 and 1, of which 1 has a given gain, and 2, which reports positions.
    fits, asked = object.__new__(JointFit), []
    pairs = SimpleNamespace(source=np.array([1, 2, -1]))
    fits._rows = SimpleNamespace(own=np.array([0, 0, 1]), pairs=pairs)  # type: ignore[assignment]
    fits._comparison = SimpleNamespace(is_radar=lambda one: one < 2)  # type: ignore[assignment]
    monkeypatch.setattr(site_errors, "sites_of", lambda *_: [(0,), (1,)])
    monkeypatch.setattr(JointFit, "_is_given", lambda _, one, kind: one == 1)
    monkeypatch.setattr(JointFit, "_search", lambda _, rows, found, known: asked.append(found))
    fits.site_errors()
    shifts = [(SHIFT, (one,)) for one in range(3)]
    assert asked == [[*shifts, (GAIN, (0,)), (SCALE, (0,)), (SCALE, (1,))]]


@pytest.mark.parametrize("name", [*RADARS])
@pytest.mark.parametrize(("north_m", "east_m"), [(1100.0, 0.0), (0.0, 1100.0)])
@pytest.mark.fault(13)
def test_of_three_radars_the_one_with_the_wrong_site_is_named_first(
    name: str, north_m: float, east_m: float
) -> None:
    """Regression: a neighbour with unusual offsets of all radars was as likely, or came first."""
    latitude, longitude, _ = RADARS[name][0]
    moved = recording().configured(
        name,
        latitude_deg=latitude + north_m / METRES_PER_DEGREE,
        longitude_deg=longitude + east_m / METRES_PER_DEGREE / np.cos(np.radians(latitude)),
    )
    (found,) = moved.diagnosed()
    assert (found.sensor_id, found.code) == (name, "site")
    assert found.sentence.startswith(f"{name}: its site is probably ")


# Each sensor has a path of its own of an aircraft without identity.
@pytest.mark.parametrize(("named", "count"), [(True, 9), (False, 9)])
def test_paths_of_two_sensors_are_not_two_aircraft(*, named: bool, count: int) -> None:
    """Regression: nine aircraft, seen by a radar and by multilateration, showed a gain."""
    source, aircraft = np.repeat([1, 2], 30), np.arange(60) % 9
    name = aircraft if named else -2 - (aircraft + 9 * source)
    rows: Any = SimpleNamespace(
        own=np.zeros(60, np.int64), pairs=SimpleNamespace(source=source, name=name)
    )
    assert site_errors._aircraft(rows, np.ones(60, np.bool_)) == count


@pytest.mark.parametrize("north_m", [3700.0, 0.0])
def test_a_site_that_few_aircraft_show_is_named(north_m: float) -> None:
    one = recording(aircraft=7)
    latitude = RADARS["1-10"][0][0] + north_m / METRES_PER_DEGREE
    found = one.configured("1-10", latitude_deg=latitude).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == ([("1-10", "site")] if north_m else [])
    if found:
        assert "its site is probably 3." in found[0].sentence
        assert "km south of the configured site" in found[0].sentence


@pytest.mark.parametrize(
    ("without", "radars"), [((), 3), (("1-10",), 3), (("1-10", "2-10", "3-10"), 0)]
)
def test_plots_by_assumed_heights_are_no_part_of_a_fit(
    without: tuple[str, ...], radars: int
) -> None:
    """Regression: ranges were said to be 0.4 % too short where no plot had a height."""
    one = recording().changed(*without, height_m=pl.lit(None, pl.Float64))
    comparison = Comparison(one.evidence())
    numbers = comparison.numbers
    compared = {
        number: (comparison.agreement(number, pairs), pairs)
        for number in numbers
        for pairs in [comparison.pairs(number, numbers)]
    }
    assert len(JointFit(one.table(), comparison, compared).radars) == radars


@pytest.mark.parametrize("others", [[], [SiteError(CLOCK, (0,), (0.5,), 900.0, 80.0)]])
def test_positions_displaced_may_be_sites_displaced_the_other_way(others: list[SiteError]) -> None:
    """Of the first error, whatever else may be wrong."""
    table = recording().table()
    sensors: Any = SimpleNamespace(ids=("adsb", *table.ids), kinds=np.array([KIND_POSITION, 1, 1]))
    displaced = SiteError(SHIFT, (0,), (0.0, 300.0), 900.0, 70.0)
    sentence = site_errors._sentence(sensors, displaced, others, ["1-10", "2-10"])
    assert sentence.startswith(
        "adsb: its positions are probably displaced by 0.30 km north (another datum?), or the "
        "sites of all radars (1-10, 2-10) by the same distance in the opposite direction"
    )
    assert ("or adsb: its clock is probably 0.50 s ahead" in sentence) == bool(others)
    assert (
        ", or the sites" in site_errors._sentence(sensors, displaced, others, ["1-10"])
    ) is False
