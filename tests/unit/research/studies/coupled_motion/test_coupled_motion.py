"""The coupled-motion study: its rows, and the paper's claim in figures."""

from dataclasses import fields
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from multiradar.errors import UnknownFilterError
from multiradar.research.studies.catalogue import COUPLED_MOTION
from multiradar.research.studies.coupled_motion import plots as coupled_motion_plots
from multiradar.research.studies.coupled_motion.figures import STATISTICS_RUNS, heading_spreads
from multiradar.research.studies.coupled_motion.models import (
    FILTERS,
    FRAME,
    INITIAL_SPEED_MPS,
    TRACKED,
    Scenario,
    filter_model,
    initial_states,
)
from multiradar.research.studies.coupled_motion.rows import Row
from multiradar.research.studies.coupled_motion.study import run
from multiradar.research.studies.coupled_motion.tracking import Flights, batches, fly, track
from multiradar.research.studies.result import StudyOptions, StudyResult

COLUMNS = [
    "part",
    "model",
    "setting",
    "filter",
    "quantity",
    "run",
    "time_s",
    "heading_deg",
    "value",
    "expected",
    "band_low",
    "band_high",
]


@cache
def small(filters: tuple[str, ...] | None = None) -> StudyResult:
    reported: list[tuple[int, int]] = []
    options = StudyOptions(runs=48, seed=3, filters=filters, duration_s=60.0)
    result = run(options, lambda done, total: reported.append((done, total)))
    assert [done for done, _ in reported] == list(range(1, reported[-1][1] + 1))
    return result


def values(result: StudyResult, **wanted: object) -> list[float]:
    return [
        float(row["value"] or 0.0)
        for row in result.rows
        if all(row[name] == value for name, value in wanted.items())
    ]


def test_a_plot_shows_the_rows_of_its_part_quantity_and_scenario_alone() -> None:
    scenario, other = TRACKED[:2]
    own: Row = {
        "part": "tracking", "model": scenario.model, "setting": scenario.setting, "filter": "a",
        "quantity": "nees", "time_s": 4.0, "value": 1.0,
    }  # fmt: skip
    others: list[Row] = [
        own | {"part": "heading"},
        own | {"quantity": "position_rms_m"},
        own | {"time_s": None},
        own | {"model": other.model, "setting": other.setting},
    ]
    found = coupled_motion_plots._tracking([own, *others], scenario, "nees", "time_s")
    assert found == {"a": [own]}


@pytest.mark.slow
def test_every_row_has_the_same_columns_and_a_finite_value() -> None:
    result = small()
    for row in result.rows:
        assert list(row) == COLUMNS
        assert isinstance(row["value"], float)
        assert np.isfinite(row["value"])
    assert {row["part"] for row in result.rows} == {"figure", "heading", "tracking"}
    assert result.options == {"runs": 48, "filters": list(FILTERS), "duration_s": 60.0}
    assert COUPLED_MOTION.filters == tuple(FILTERS)
    assert result.json_object()["study"] == "coupled-motion"


@pytest.mark.slow
def test_errors_at_a_time_have_their_nees_and_its_band() -> None:
    timed = [row for row in small().rows if row["part"] == "tracking" and row["time_s"] is not None]
    keys = ("model", "setting", "filter", "time_s")
    by_quantity = {
        quantity: [tuple(row[key] for key in keys) for row in timed if row["quantity"] == quantity]
        for quantity in ("position_rms_m", "velocity_rms_mps", "nees")
    }
    assert by_quantity["nees"] == by_quantity["position_rms_m"] == by_quantity["velocity_rms_mps"]
    assert len(by_quantity["nees"]) * 3 == len(timed) > 0
    # Mean of 48 runs with 6 components, over 6: χ² with 288 degrees of freedom.
    band = chi2.ppf([0.025, 0.975], 288) / 288
    for row in timed:
        if row["quantity"] == "nees":
            assert row["expected"] == 1.0
            assert [row["band_low"], row["band_high"]] == pytest.approx(band)
        else:
            assert row["band_low"] is row["band_high"] is None


@pytest.mark.slow
def test_a_choice_of_filters_changes_nothing_but_their_rows() -> None:
    some = small(("velocity-frame", "relative-speed"))
    kept = [
        row for row in small().rows if row["filter"] in (None, "velocity-frame", "relative-speed")
    ]
    assert sorted(some.rows, key=str) == sorted(kept, key=str)
    assert some.tables[0].header[2:] == ("velocity-frame", "relative-speed")


def test_an_unknown_filter_is_reported() -> None:
    with pytest.raises(UnknownFilterError, match="unknown filter 'joint'"):
        run(StudyOptions(filters=("joint",)), lambda done, total: None)


def test_trajectories_begin_at_the_origin_and_last_as_long_as_asked() -> None:
    result = small()
    for quantity in ("east_m", "north_m"):
        assert set(values(result, part="figure", quantity=quantity, time_s=0.0)) == {0.0}
    times = [row["time_s"] for row in result.rows if row["part"] == "figure"]
    assert max(float(time or 0.0) for time in times) == 60.0
    assert len(result.plots[0].series) == 8


def test_the_course_of_model_5_walks_as_its_parameter_says() -> None:
    """v_K √(T t), within the 99.9 % band of 400 trajectories."""
    low, high = np.sqrt(chi2.ppf([5e-4, 1.0 - 5e-4], STATISTICS_RUNS) / STATISTICS_RUNS)
    for rate in (3, 6):
        setting = f"a = 1 m/s², v_K = {rate} °/s"
        (turned,) = values(small(), part="figure", quantity="turned_deg", setting=setting)
        assert low < turned / (rate * np.sqrt(60.0)) < high


def test_model_2_accelerates_alike_along_and_across() -> None:
    for acceleration in (1.0, 2.0):
        setting = f"a = {acceleration:g} m/s²"
        for quantity in ("acceleration_along_mps2", "acceleration_across_mps2"):
            (found,) = values(small(), part="figure", quantity=quantity, setting=setting)
            assert found == pytest.approx(acceleration, rel=0.02)


def test_simulated_accelerations_lie_in_their_band_at_every_heading() -> None:
    for row in small().rows:
        if row["part"] == "heading":
            value, low, high = (float(row[name] or 0.0) for name in ("value", *COLUMNS[-2:]))
            assert low <= value <= high


def test_only_the_velocity_frame_separates_along_from_across() -> None:
    equal, unequal, relative, frame = heading_spreads(np.random.default_rng(0))
    assert np.ptp(frame.along_exact) == np.ptp(frame.across_exact) == 0.0
    assert frame.across_exact[0] == pytest.approx(INITIAL_SPEED_MPS * np.radians(3.0), rel=2e-3)
    np.testing.assert_allclose(equal.along_exact, equal.across_exact, rtol=1e-14)
    for other in (unequal, relative):
        assert np.ptp(other.along_exact) > 0.25 * other.along_exact.max()
    # Along an axis (heading 0) nothing turns an aircraft of the relative-speed variant.
    assert relative.across_exact[0] == relative.across[0] == 0.0


def test_every_filter_has_the_same_accelerations() -> None:
    """At the initial speed, mean over headings: the traces of the velocity noise agree."""
    states = initial_states(batches(360, 1)[0])
    for scenario in TRACKED:
        total = scenario.along_mps2**2 + scenario.across_mps2**2 + scenario.upward_mps2**2
        for name in FILTERS:
            model = filter_model(name, scenario, states)
            own = model.coordinates.from_cartesian(states)
            slope = model.coordinates.to_cartesian_jacobian(own)
            noise = slope @ model.noise(own, 1.0) @ np.swapaxes(slope, -1, -2)
            trace = np.trace(noise[:, 3:, 3:], axis1=-2, axis2=-1).mean()
            assert trace == pytest.approx(total, rel=2e-3), (scenario, name)


@pytest.mark.parametrize("scenario", TRACKED[:5], ids=lambda one: f"{one.model} {one.setting}")
def test_a_filter_with_the_true_model_is_consistent(scenario: Scenario) -> None:
    """NEES / 6 of 40 flights: their own scatter gives the band of three sigmas."""
    flights = fly(scenario, batches(40, 80)[0], 80, np.random.default_rng(11))
    by_run = track(filter_model(scenario.model, scenario, flights.start), flights).nees_by_run
    assert abs(by_run.mean() - 1.0) < 3.0 * by_run.std() / np.sqrt(40.0) + 0.02


def test_along_an_axis_the_relative_filter_loses_an_aircraft_that_turns() -> None:
    result = small()
    model = {"part": "tracking", "quantity": "nees", "model": FRAME}
    for heading in (0.0, 90.0, 180.0, 270.0):
        along = values(result, **model, filter="relative-speed", heading_deg=heading)
        between = values(result, **model, filter="relative-speed", heading_deg=heading + 45.0)
        assert len(along) == len(between) == 5
        assert np.mean(along) > 3.0 * np.mean(between)
        frame = values(result, **model, filter="velocity-frame", heading_deg=heading)
        assert np.mean(frame) < 1.5


def test_hard_turns_are_tracked_better_in_the_velocity_frame() -> None:
    setting = {"setting": "a = 1 m/s², v_K = 6 °/s", "time_s": None, "heading_deg": None}
    for quantity in ("position_rms_m", "velocity_rms_mps"):
        (coupled,) = values(small(), quantity=quantity, filter="velocity-frame", **setting)
        (by_axes,) = values(small(), quantity=quantity, filter="cartesian-acceleration", **setting)
        assert coupled < 0.97 * by_axes


def test_the_tables_hold_the_values_of_the_rows() -> None:
    result = small()
    velocity, position, nees, figure = result.tables
    for table, quantity in (
        (velocity, "velocity_rms_mps"),
        (position, "position_rms_m"),
        (nees, "nees"),
    ):
        cells = [float(cell or 0.0) for row in table.rows for cell in row[2:]]
        wanted = {"part": "tracking", "time_s": None, "heading_deg": None}
        assert cells == values(result, quantity=quantity, **wanted)
        assert len(table.rows) == len(TRACKED)
    assert len(figure.rows) == 4


def test_batches_together_are_all_flights() -> None:
    """Long studies run in parts; combined results equal those of one part."""
    parts = batches(10, 300_000)
    assert [len(part) for part in parts] == [3, 3, 3, 1]
    np.testing.assert_array_equal(np.concatenate(parts), batches(10, 10)[0])
    assert [len(part) for part in batches(3, 10_000_000)] == [1, 1, 1]
    flights = fly(TRACKED[0], np.concatenate(parts), 20, np.random.default_rng(2))
    model = filter_model(FRAME, TRACKED[0], flights.start)
    whole = track(model, flights)
    first = track(model, part_of(flights, slice(0, 4)))
    together = first + track(model, part_of(flights, slice(4, 10)))
    for field in fields(whole):
        found, expected = getattr(together, field.name), getattr(whole, field.name)
        np.testing.assert_allclose(found, expected, rtol=1e-12)


def part_of(flights: Flights, runs: slice) -> Flights:
    return Flights(
        flights.start[runs], flights.guess[runs], flights.truth[:, runs], flights.measured[:, runs]
    )
