"""Implausible aircraft-derived data are dropped and counted by reason; plausible ones are kept."""

import math
from typing import Any

import numpy as np
import pyproj
import pytest

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.checking import checked, reason_counts
from multiradar_converters.aircraft_data.figures import DataFigures
from multiradar_converters.aircraft_data.plausibility import (
    calibrated_airspeed_m_s,
    findings,
    speed_of_sound_m_s,
)
from multiradar_converters.aircraft_data.sequences import (
    Reports,
    plane_positions,
    plot_velocities,
    sequence_findings,
)
from multiradar_converters.aircraft_data.variation import magnetic_variation
from multiradar_converters.asterix.aircraft_reports import screened
from multiradar_schemas.measurements.units import KNOT_MPS

CRUISE: dict[int, float] = {
    q.MAGNETIC_HEADING: 84.0,
    q.ROLL: 0.0,
    q.TRACK_ANGLE: 90.0,
    q.TRACK_ANGLE_RATE: 0.0,
    q.GROUND_SPEED: 240.0,
    q.TRUE_AIRSPEED: 231.0,
    q.INDICATED_AIRSPEED: 135.5,
    q.MACH: 0.78,
    q.VERTICAL_RATE: 0.0,
    q.SELECTED_ALTITUDE: 11_000.0,
}
HEIGHT_M = 10_973.0


def values(*changes: dict[int, float]) -> q.Numbers:
    """Return reports in cruise, each with some other values."""
    rows = [CRUISE | change for change in changes or ({},)]
    return np.array([[row[k] for k in range(q.COUNT)] for row in rows])


def dropped(change: dict[int, float]) -> tuple[set[str], set[str]]:
    """Return the reasons, and the quantities that are dropped."""
    kept, bits = checked(values(change), np.array([HEIGHT_M]))
    lost = {name for name, value in zip(q.QUANTITIES, kept[0], strict=True) if np.isnan(value)}
    return set(reason_counts(bits)), lost


MOTION = {
    "roll_deg", "track_angle_deg", "track_angle_rate_deg_s", "ground_speed_m_s",
    "true_airspeed_m_s",
}  # fmt: skip
AIR = {"magnetic_heading_deg", "indicated_airspeed_m_s", "mach", "vertical_rate_m_s"}


@pytest.mark.parametrize(
    ("change", "reasons", "lost"),
    [
        ({}, set(), set()),
        # A turn to the right at 25° of roll, as coordinated flight has it; and its wrong signs.
        ({q.ROLL: 25.0, q.TRACK_ANGLE_RATE: 1.1}, set(), set()),
        ({q.ROLL: -30.0, q.TRACK_ANGLE_RATE: 1.4}, {"roll_and_rate"},
         {"roll_deg", "track_angle_rate_deg_s"}),
        ({q.ROLL: 0.2, q.TRACK_ANGLE_RATE: 11.5}, {"roll_and_rate"},
         {"roll_deg", "track_angle_rate_deg_s"}),
        ({q.ROLL: 80.0, q.TRACK_ANGLE_RATE: math.nan}, {"out_of_range"}, MOTION),
        ({q.GROUND_SPEED: 20.0}, {"wind"}, MOTION),
        ({q.INDICATED_AIRSPEED: 240.0}, {"airspeed_and_mach"}, AIR),
        ({q.TRUE_AIRSPEED: 150.0}, {"true_and_mach"}, MOTION | AIR),
        ({q.MAGNETIC_HEADING: 264.0}, {"track_and_heading"}, MOTION | AIR),
        ({q.VERTICAL_RATE: -130.0}, {"out_of_range"}, AIR),
        ({q.SELECTED_ALTITUDE: 19_999.0}, set(), set()),
        ({q.SELECTED_ALTITUDE: 21_000.0}, {"out_of_range"}, {"selected_altitude_m"}),
    ],
)  # fmt: skip
def test_each_fault_drops_what_it_concerns(
    change: dict[int, float], reasons: set[str], lost: set[str]
) -> None:
    assert dropped(change) == (reasons, lost)


def test_missing_values_contradict_nothing() -> None:
    for quantity in range(q.COUNT):
        assert dropped({quantity: math.nan})[0] == set()
    nothing = q.absent(3)
    kept, bits = checked(nothing, np.full(3, HEIGHT_M))
    assert np.isnan(kept).all()
    assert not bits.any()


def test_airspeeds_of_a_parked_aircraft_are_not_compared() -> None:
    # Pitot probes read 30 kt, the Mach number 0 and the track angle anything.
    parked = {
        q.GROUND_SPEED: 0.0, q.TRUE_AIRSPEED: 0.0, q.INDICATED_AIRSPEED: 15.4, q.MACH: 0.0,
        q.TRACK_ANGLE: 300.0, q.TRACK_ANGLE_RATE: 15.0,
    }  # fmt: skip
    kept, bits = checked(values(parked), np.array([0.0]))
    assert not bits.any()
    assert not np.isnan(kept).any()


def test_airspeed_of_a_mach_number_is_that_of_the_standard_atmosphere() -> None:
    # U.S. Standard Atmosphere, 1976: the pressure at 35 000 ft is 0.2353 of that at sea level, so
    # that Mach 0.8 is sqrt(5 ((0.2353 (1.128^3.5 - 1) + 1)^(2/7) - 1)) of 661.5 kt.
    at_height = calibrated_airspeed_m_s(np.array([0.8, 0.5]), np.array([10_668.0, 0.0]))
    assert at_height / KNOT_MPS == pytest.approx([271.9, 330.7], abs=0.2)
    assert speed_of_sound_m_s(np.array([0.0, 11_000.0, 15_000.0])) == pytest.approx(
        [340.3, 295.1, 295.1], abs=0.1
    )


def test_a_known_variation_narrows_the_drift() -> None:
    # 90 m/s of wind explain 24° of drift, and 130 m/s 35°.
    crossed = values({q.MAGNETIC_HEADING: 40.0})
    height = np.array([HEIGHT_M])
    assert not findings(crossed, height)
    assert [one.reason for one in findings(crossed, height, 0.0)] == ["track_and_heading"]
    assert not findings(crossed, height, 20.0)


def flight(count: int, *, turns_deg_per_s: float = 0.0, step_s: float = 4.0) -> dict[str, Any]:
    """Return positions, times and values of an aircraft with constant speed."""
    time_s = step_s * np.arange(count, dtype=np.float64)
    track = np.radians(90.0 + turns_deg_per_s * time_s)
    east = np.cumsum(240.0 * np.sin(track)) * step_s
    north = np.cumsum(240.0 * np.cos(track)) * step_s
    own = values(*[{}] * count)
    own[:, q.TRACK_ANGLE] = np.degrees(track) % 360.0
    own[:, q.INDICATED_AIRSPEED] += np.arange(count) % 2
    nothing = np.full(count, np.nan)
    range_m = np.full(count, 80_000.0)
    reports = Reports(np.full(count, 7), time_s, east, north, range_m, nothing, nothing)
    return {"values": own, "reports": reports}


def reasons_of(values: q.Numbers, reports: Reports) -> dict[str, list[int]]:
    found = sequence_findings(values, reports)
    return {one.reason: np.flatnonzero(one.where).tolist() for one in found}


def test_straight_and_turning_flight_agrees_with_its_positions() -> None:
    straight = flight(60)
    straight["values"][:, q.ROLL] = np.arange(60) % 3
    assert reasons_of(**straight) == {}
    assert reasons_of(**flight(60, turns_deg_per_s=2.0)) == {}


def test_a_register_that_is_not_updated_is_dropped_after_its_first_report() -> None:
    stuck = flight(60)
    own = stuck["values"]
    own[:, q.ROLL] = np.arange(60) % 3
    own[20:45, q.ROLL] = 0.5
    assert reasons_of(**stuck) == {"unchanged": list(range(21, 45))}
    # Half a minute of smooth cruise is possible.
    own[28:45, q.ROLL] = np.arange(17) % 3
    assert reasons_of(**stuck) == {}


def test_the_order_of_reports_and_other_aircraft_do_not_matter() -> None:
    stuck, other = flight(40), flight(40)
    other["values"][:, q.ROLL] = np.arange(40) % 3
    both = np.concatenate([stuck["values"], other["values"]])
    parts: Any = zip(
        stuck["reports"], other["reports"]._replace(aircraft=np.full(40, 8)), strict=True
    )
    reports = Reports(*(np.concatenate(part) for part in parts))
    order = np.random.default_rng(1).permutation(80)
    mixed: Any = (column[order] for column in reports)
    found = sequence_findings(both[order], Reports(*mixed))
    assert [one.reason for one in found] == ["unchanged"]
    assert np.sort(order[found[0].where]).tolist() == list(range(1, 40))


def test_motion_of_another_aircraft_is_dropped() -> None:
    swapped = flight(40, turns_deg_per_s=1.0)
    swapped["values"][10, [q.TRACK_ANGLE, q.GROUND_SPEED]] = (290.0, 130.0)
    stale = swapped["values"][20, q.TRACK_ANGLE]
    swapped["values"][20:34, q.TRACK_ANGLE] = stale
    found = reasons_of(**swapped)["positions"]
    assert found[0] == 10
    assert set(range(30, 34)) <= set(found) <= {10, *range(21, 34)}


@pytest.mark.parametrize("course", [0.0, 45.0, 90.0, 180.0, 270.0])
@pytest.mark.parametrize(
    "place",
    [(0.0, 0.0), (55.7, 37.6), (36.0, 140.0), (40.0, -75.0), (-41.0, 179.99), (89.0, -75.0)],
)
def test_positions_anywhere_on_the_earth_agree_with_the_motion(
    place: tuple[float, float], course: float
) -> None:
    """Regression: east was measured from Greenwich: a change of latitude shifted it."""
    count, speed = 40, 230.0
    time_s = 4.0 * np.arange(count, dtype=np.float64)
    whole = np.full(count, 1.0)
    longitude, latitude, back = pyproj.Geod(ellps="WGS84").fwd(
        whole * place[1], whole * place[0], whole * course, speed * time_s
    )
    own = values(*[{}] * count)
    own[:, q.GROUND_SPEED], own[:, q.TRACK_ANGLE] = speed, (np.asarray(back) + 180.0) % 360.0
    own[0, q.TRACK_ANGLE] = course
    nothing = np.full(count, np.nan)
    reports = Reports(np.full(count, 7), time_s, nothing, nothing, nothing, latitude, longitude)
    track = np.radians(own[:, q.TRACK_ANGLE])
    east, north, _ = plot_velocities(reports)
    inside = slice(1, -1)
    error = np.hypot(east - speed * np.sin(track), north - speed * np.cos(track))[inside]
    assert error.max() < 0.01 * speed
    own[:, q.ROLL] = own[:, q.VERTICAL_RATE] = np.arange(count) % 3
    assert reasons_of(own, reports) == {}
    kept = {"time_s": time_s, "latitude_deg": latitude, "longitude_deg": longitude}
    kept |= {"range_m": nothing, "azimuth_deg": nothing, "height_m": whole * HEIGHT_M}
    whole_numbers = np.zeros(count, np.int64)
    seen = screened(own, whole_numbers, whole_numbers, whole_numbers + 7, kept)
    assert np.isfinite(seen.values[:, q.TRACK_ANGLE]).all()
    own[20, q.TRACK_ANGLE] += 180.0
    assert reasons_of(own, reports)["positions"] == [20]


def test_variation_is_that_with_the_least_scatter_of_the_winds() -> None:
    random = np.random.default_rng(3)
    heading, wind = random.uniform(0.0, 360.0, 500), np.array([40.0, -10.0])
    height = random.uniform(6000.0, 11_000.0, 500)
    nose = np.radians(heading + 12.3 + random.normal(0.0, 0.3, 500))
    velocity = 230.0 * np.stack([np.sin(nose), np.cos(nose)], axis=1) + wind
    own = values(*[{}] * 500)
    own[:, q.MAGNETIC_HEADING] = heading
    own[:, q.TRUE_AIRSPEED] = 230.0
    own[:, q.GROUND_SPEED] = np.hypot(*velocity.T)
    own[:, q.TRACK_ANGLE] = np.degrees(np.arctan2(*velocity.T)) % 360.0
    found = magnetic_variation(own, height)
    assert found is not None
    assert found == pytest.approx(12.3, abs=0.2)
    same = np.repeat(own[:1], 500, axis=0)
    same[:, q.GROUND_SPEED] += random.normal(0.0, 3.0, 500)
    assert magnetic_variation(same, height) is None


def test_noise_is_estimated_from_neighbours_and_not_below_the_rounding() -> None:
    random = np.random.default_rng(4)
    count = 600
    time_s = 4.0 * np.arange(count, dtype=np.float64)
    own = values(*[{}] * count)
    own[:, q.MAGNETIC_HEADING] = (350.0 + 0.1 * time_s + random.normal(0.0, 0.8, count)) % 360.0
    own[:, q.GROUND_SPEED] = np.round(240.0 + 0.01 * time_s)
    own[5:, q.ROLL] = np.nan
    figures = DataFigures()
    bits = np.zeros(count, np.int64)
    figures.add(own, bits, np.full(count, 3), time_s, np.full(count, HEIGHT_M))
    assert figures.sigma(q.MAGNETIC_HEADING) == pytest.approx(0.8, rel=0.1)
    assert figures.sigma(q.GROUND_SPEED) == pytest.approx(1.0 / math.sqrt(12.0))
    assert figures.sigma(q.ROLL) is None
    document = figures.document()
    assert document["reports"] == document["with_data"] == count
    assert document["values"]["roll_deg"] == {"reports": 5, "sigma": None}  # type: ignore[index]


def test_what_is_retained_for_figures_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("RESIDUALS_MAX", "VALUES_MAX", "REPORTS_MAX"):
        monkeypatch.setattr(f"multiradar_converters.aircraft_data.figures.{name}", 100)
    figures, count = DataFigures(), 60
    own, bits, height = values(*[{}] * count), np.zeros(count, np.int64), np.full(count, HEIGHT_M)
    for part in range(10):
        time_s = 4.0 * (part * count + np.arange(count, dtype=np.float64))
        figures.add(own, bits, np.full(count, 3), time_s, height)
    assert figures.reports == 10 * count
    for retained in (figures._reports, *figures._values, *figures._residuals):
        assert 100 <= sum(map(len, retained)) <= 160


def test_a_height_farther_below_the_radar_than_the_range_has_a_position() -> None:
    """Regression: a warning of NumPy was shown for damaged records."""
    east, north = plane_positions(np.array([100.0]), np.array([90.0]), np.array([-900.0]))
    assert (east.tolist(), north.tolist()) == ([0.0], [0.0])
