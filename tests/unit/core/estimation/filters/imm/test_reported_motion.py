"""Interacting modes with the motion that aircraft report: exactness, accuracy, wrong reports."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.filters._hypothesis_kernels import copy_aircraft
from multiradar.estimation.filters.arrays import (
    SLOW_COUNT,
    Aircraft,
    aircraft_arrays,
)
from multiradar.estimation.filters.imm._slow_state_kernels import REJECTED_COUNT
from multiradar.estimation.measurement.aircraft_data import AircraftData
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.paths import fly
from multiradar.simulation.scenario.reported_data import Atmosphere, RegisterReports
from multiradar.tracking.mode_states import mode_states
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.references.compiled_filters import UPPER
from validation.motion.check_aircraft_derived import AIR, BOTH, FAULTY, ONLY_AIR, STORM
from validation.motion.check_manoeuvres import Figure, Flown, figures, flights

pytestmark = pytest.mark.slow

Floats = NDArray[np.float64]


def settings() -> TrackingSettings:
    return TrackingSettings(filter_name="imm")


Reporting = Callable[[RegisterReports | None, Atmosphere], list[Flown]]


@pytest.fixture(scope="module")
def reporting() -> Reporting:
    @cache
    def found(registers: RegisterReports | None, air: Atmosphere) -> list[Flown]:
        return flights(
            1, aircraft=20, duration_s=900.0, known=True, first_seed=40, registers=registers,
            air=air,
        )  # fmt: skip

    return found


@pytest.fixture(scope="module")
def flown(reporting: Reporting) -> list[Flown]:
    return reporting(None, AIR)


@pytest.fixture(scope="module")
def without(flown: list[Flown]) -> dict[str, Figure]:
    return figures(settings(), flown)


@pytest.mark.parametrize(
    ("registers", "air", "ratio"),
    [
        (BOTH, AIR, 0.75),
        (RegisterReports(("5,0",)), AIR, 0.75),
        (ONLY_AIR, AIR, 0.9),
        (ONLY_AIR, STORM, 1.0),
        (FAULTY, AIR, 0.8),
    ],
)
def test_reports_lower_the_errors_and_sigmas_stay_consistent(
    without: dict[str, Figure], reporting: Reporting, registers: RegisterReports, air: Atmosphere,
    ratio: float,
) -> None:  # fmt: skip
    found = figures(settings(), reporting(registers, air))
    assert found["turns"].rms_m <= ratio * without["turns"].rms_m
    assert found["straights"].rms_m <= without["straights"].rms_m
    for motion in ("turns", "straights", "all"):
        assert 0.5 <= found[motion].nees <= 1.3, motion


# One aircraft in twenty each: frozen registers, a stuck heading, a roll of the wrong sign.
def test_unchecked_faults_leave_sigmas_consistent(reporting: Reporting) -> None:
    found = figures(settings(), reporting(replace(FAULTY, checks=False), AIR))
    for motion in ("turns", "straights", "all"):
        assert found[motion].nees <= 1.3, motion


def updates_of(one: Flown) -> TrackUpdates:
    engine = Engine(one.sensors, settings())
    found = TrackUpdates.concatenate([engine.push(one.batch).updates, engine.flush().updates])
    engine.close()
    return found


def only_of(data: AircraftData, rows: NDArray[np.bool_]) -> AircraftData:
    return AircraftData(*(np.where(rows, column, np.nan) for column in data))


def test_reports_of_one_aircraft_change_no_other(flown: list[Flown], reporting: Reporting) -> None:
    one = reporting(BOTH, AIR)[0]
    data = one.batch.aircraft_data
    assert data is not None
    own = one.batch.track_number == 3
    given = replace(one, batch=replace(one.batch, aircraft_data=only_of(data, own)))
    without, found = updates_of(flown[0]), updates_of(given)
    others = without.track_number != 3
    for name in ("latitude_rad", "longitude_rad", "speed_mps", "position_sigma_m", "height_m"):
        before, after = getattr(without, name), getattr(found, name)
        np.testing.assert_array_equal(before[others], after[others])
        assert not np.array_equal(before[~others], after[~others]) or name == "height_m"


# An aircraft changes to another compass: rejected, then a slow state again.
def test_a_compass_that_jumps_is_found_out(
    without: dict[str, Figure], reporting: Reporting
) -> None:
    given = []
    for one in reporting(ONLY_AIR, AIR):
        data = one.batch.aircraft_data
        assert data is not None
        late = one.batch.time_s > 450.0
        heading = (data.magnetic_heading_rad + np.radians(20.0) * late) % (2.0 * np.pi)
        wrong = data._replace(magnetic_heading_rad=heading)
        given.append(replace(one, batch=replace(one.batch, aircraft_data=wrong)))
    found = figures(settings(), given)
    assert found["all"].rms_m <= without["all"].rms_m
    assert found["all"].nees <= 1.3


# Roll, track angle and speeds: nothing that a compass could have got wrong.
def test_reports_without_a_heading_reject_none(reporting: Reporting) -> None:
    one = reporting(RegisterReports(("5,0",)), AIR)[0]
    engine = Engine(one.sensors, settings())
    engine.push(one.batch.select(one.batch.time_s < 120.0))
    aircraft = engine._pool.aircraft
    assert np.isfinite(aircraft.slow[:, 0]).any()
    assert np.nanmax(aircraft.reported[:, REJECTED_COUNT]) == 0.0
    engine.close()


# Aircraft that climb, with a wrong number now and then.
def test_reported_vertical_rates_follow_climbs_sooner(flown: list[Flown]) -> None:
    one, rng = flown[0], np.random.default_rng(6)
    climb = np.zeros(len(one.rows))
    for index, aircraft in enumerate(one.fliers):
        own = one.rows.aircraft == index
        path, time_s = fly(aircraft, 900.0, rng), one.rows.time_s[own]
        climb[own] = path.height(time_s + 0.5) - path.height(time_s - 0.5)
    nothing = np.full(len(climb), np.nan)
    rate = climb + rng.normal(0.0, 0.3, len(climb))
    rate[rng.uniform(size=len(rate)) < 0.01] = 60.0
    columns = dict.fromkeys(AircraftData._fields, nothing) | {"vertical_rate_m_s": rate}
    given = replace(one, batch=replace(one.batch, aircraft_data=AircraftData(**columns)))
    errors = []
    for each in (one, given):
        updates = updates_of(each)
        keys = list(zip(updates.time_s, updates.sensor, updates.track_number - 1, strict=True))
        truth = dict(
            zip(
                zip(one.rows.time_s, one.rows.sensor, one.rows.aircraft, strict=True),
                climb,
                strict=True,
            )
        )
        off = updates.vertical_rate_mps - np.array([truth[key] for key in keys])
        errors.append(np.sqrt(np.nanmean(off[updates.time_s > 60.0] ** 2)))
    assert errors[1] < 0.75 * errors[0]


def reporting_aircraft() -> tuple[Aircraft, Floats]:
    rng = np.random.default_rng(2)
    aircraft = aircraft_arrays(2, 1, modes=3)
    aircraft.mode_probability[:] = 1.0 / 3.0
    aircraft.mean[:], aircraft.mode_mean[:] = 100.0, 100.0
    aircraft.covariance[:] = aircraft.mode_covariance[:] = np.diag([4.0, 4.0, 1.0, 1.0])[UPPER]
    aircraft.slow[1] = rng.normal(size=SLOW_COUNT)
    root = rng.normal(size=(SLOW_COUNT, SLOW_COUNT))
    aircraft.slow_covariance[1] = root @ root.T
    aircraft.slow_sensitivity[3:] = rng.normal(size=(3, 4, SLOW_COUNT))
    spread = aircraft.slow_sensitivity[3:] @ aircraft.slow_covariance[1]
    return aircraft, spread @ aircraft.slow_sensitivity[3:].swapaxes(1, 2)


def test_modes_include_the_uncertainty_of_the_slow_states() -> None:
    aircraft, spread = reporting_aircraft()
    states = mode_states(aircraft, np.array([0, 1]), np.zeros(1), np.zeros((1, 1)))
    np.testing.assert_array_equal(states.covariance[0], aircraft.mode_covariance[:3])
    np.testing.assert_allclose(
        states.covariance[1] - aircraft.mode_covariance[3:], spread[:, UPPER[0], UPPER[1]]
    )


def test_copies_of_an_aircraft_absorb_its_slow_states() -> None:
    aircraft, spread = reporting_aircraft()
    copies = aircraft_arrays(2, 1, modes=3)
    copy_aircraft(np.array([1]), np.array([0, 2]), aircraft, copies)
    assert np.isnan(copies.slow[:, 0]).all()
    for h in range(2):
        np.testing.assert_allclose(
            copies.mode_covariance[3 * h : 3 * h + 3] - aircraft.mode_covariance[3:],
            spread[:, UPPER[0], UPPER[1]],
        )
