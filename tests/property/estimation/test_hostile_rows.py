"""For any input every row has an outcome, and all states are finite."""

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Rows, Work, result_arrays
from multiradar.estimation.filters.bank import FILTERS, Outcome
from multiradar.estimation.measurement._kernels import PARAMETER_TIME_OFFSET
from multiradar.geodesy._kernels import plane_parameters, site_parameters
from multiradar.tracking.model import _options
from multiradar.tracking.modes import mode_table
from multiradar.tracking.settings import VELOCITY_FRAME, TrackingSettings

PLANE = plane_parameters(0.98, 1.06)
#: A radar of each kind: usual, on a flat plane, and without errors.
SENSORS, COLUMNS, SLOTS = 3, 6, 2
NO_GATES = {"downweight_nis": np.inf, "refuse_nis": np.inf, "cone_ratio": 0.0}
TRACKING: dict[str, dict[str, Any]] = {
    "gated": {},
    "not gated": NO_GATES,
    "velocity frame": {"motion": VELOCITY_FRAME, **NO_GATES},
}
#: Every filter, and those that estimate time offsets with them.
CASES = [*((name, False) for name in FILTERS), ("two-stage", True), ("imm", True)]
DIAGONAL = [0, 4, 7, 9]

Row = tuple[int, float, int, int, float, float, float]

odd = st.sampled_from([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e308, -1e308, 5e-324, 1e150])
values = st.floats(1.0, 3e5) | odd
angles = st.floats(-4.0, 4.0) | odd
rows = st.tuples(
    st.integers(-2, SLOTS - 1),
    st.floats(0.0, 60.0) | st.sampled_from([2e5, 4e5]) | odd,
    st.integers(-1, 6),
    st.integers(0, SENSORS - 1),
    values,
    angles,
    st.floats(0.0, 12e3) | odd,
)


def hostile_model(tracking: TrackingSettings, *, timed: bool) -> Model:
    sites = np.array(
        [site_parameters(PLANE, 0.985 + 0.01 * i, 1.05, 300.0) for i in range(SENSORS)]
    )
    noise = np.array([[1600.0, 1e-6, 900.0, 300.0]] * SENSORS)
    noise[2, :3] = 0.0
    sigmas = np.tile([500.0, 0.005], SENSORS)
    return Model(
        plane=PLANE,
        sites=sites,
        noises=noise,
        site_numbers=np.arange(SENSORS),
        starts=np.arange(0, COLUMNS + 1, 2),
        parameters=np.tile([0, PARAMETER_TIME_OFFSET if timed else 1], SENSORS),
        bias=np.zeros(COLUMNS),
        bias_covariance=np.diag(sigmas**2),
        factor=np.diag(sigmas),
        options=_options(tracking),
        modes=mode_table(tracking),
    )


def statuses(rows: NDArray[Any]) -> NDArray[np.int64]:
    """All ground statuses in turn: on the ground, unknown, airborne."""
    return np.resize(np.array([1, -1, 0]), len(rows))


@pytest.mark.parametrize(("name", "timed"), CASES)
@pytest.mark.parametrize("how", sorted(TRACKING))
@settings(max_examples=40)
@given(sequence=st.lists(rows, min_size=1, max_size=12))
@example([(0, 1.0, 4, 2, 1e4, 2e4, 0.0)] * 6)
@example([(0, 1.0, 3, 2, 5e4, 0.3, 0.0), (0, 0.5, 3, 2, 5e4, 0.3, 0.0)] * 3)
@example([(0, 1.0, 1, 0, 1e4, 0.0, np.inf), (0, 2.0, 1, 0, 1e308, 0.0, np.nan)])
@example(
    [(0, 1.0, 0, 0, 5e4, 1.0, 3e3), (0, 5.0, 0, 1, 6e4, 1.0, 3e3), (0, 9.0, 0, 2, 1.0, 1.0, 0.0)]
)
@example([(0, float(i), 0, i % 3, 5e4, 1.0, 3e3) for i in range(9)])
@example([(0, 1.0 + i, 1, i % 3, 1e4, 1e4, 3e3) for i in range(9)])
@example([(0, 1.0, 1, i, 1e4, 1e4, 3e3) for i in range(3)])
@example([(0, 1.0, 0, 0, 5e4, 1.0, np.nan), *[(0, 2.0, 5, i, 0.1, 1.0, np.nan) for i in range(3)]])
@example([(0, 1.0, 0, 0, 5e4, 1.0, 3e3), *[(0, 2.0, 5, i, 0.1, 1.0, 3e3) for i in range(3)]])
@pytest.mark.fault(9, 10)
def test_states_remain_finite_for_invalid_rows(
    name: str, timed: bool, how: str, sequence: list[Row]
) -> None:
    definition = FILTERS[name]
    slot, time, kind, sensor, z0, z1, height = (
        np.array(column) for column in zip(*sequence, strict=True)
    )
    given_rows = Rows(
        slot, time, kind, sensor, np.stack([z0, z1], axis=-1), height, sensor, statuses(slot)
    )
    count = len(slot)
    model = hostile_model(TrackingSettings(filter_name=name, **TRACKING[how]), timed=timed)
    aircraft = definition.aircraft(SLOTS, COLUMNS, SENSORS, len(model.modes))
    result = result_arrays(count, 1, COLUMNS)
    result.outcome[:] = -1
    work = Work(np.array([0]), np.array([0, count]), np.arange(count))
    definition.step(work, given_rows, model, aircraft, result, want_readout=True)
    definition.close(np.arange(SLOTS), model, aircraft, result.information, result.vector)
    # Raises for an undefined outcome.
    outcomes = {Outcome(code) for code in result.outcome.tolist()}
    started = ~np.isnan(aircraft.time)
    assert started.any() == bool(outcomes & {Outcome.STARTED})
    for array in (aircraft.mean, aircraft.covariance, aircraft.sensitivity, aircraft.fading_nis):
        assert np.isfinite(array).all()
    assert (aircraft.covariance[:, DIAGONAL] >= 0.0).all()
    for array in (aircraft.mode_mean, aircraft.mode_covariance, aircraft.mode_sensitivity):
        assert np.isfinite(array).all()
    assert (aircraft.mode_covariance[:, DIAGONAL] >= 0.0).all()
    assert not np.isinf(aircraft.mode_probability).any()
    assert np.isfinite(aircraft.joint).all()
    assert (np.diag(aircraft.joint) >= 0.0).all()
    for sums in (result.information, result.vector, result.log, result.readout[:, :8]):
        assert np.isfinite(sums).all()
    assert np.isfinite(model.bias).all()
    assert np.isfinite(model.bias_covariance).all()
    assert (np.diag(model.bias_covariance) >= 0.0).all()
    assert np.isfinite(aircraft.time[started]).all()
    assert not np.isinf(aircraft.height).any()


def outcomes_of(name: str, sequence: list[Row]) -> list[Outcome]:
    definition = FILTERS[name]
    columns = [np.array(column) for column in zip(*sequence, strict=True)]
    z = np.stack(columns[4:6], axis=-1)
    slot, time, kind, sensor = columns[:4]
    given_rows = Rows(slot, time, kind, sensor, z, columns[6], sensor, statuses(slot))
    tracking = TrackingSettings(filter_name=name, refusals_max=3)
    model = hostile_model(tracking, timed=False)
    aircraft = definition.aircraft(SLOTS, COLUMNS, SENSORS, len(model.modes))
    result = result_arrays(len(sequence), 1, COLUMNS)
    work = Work(np.array([0]), np.array([0, len(sequence)]), np.arange(len(sequence)))
    definition.step(work, given_rows, model, aircraft, result, want_readout=False)
    return [Outcome(code) for code in result.outcome.tolist()]


START: Row = (0, 1.0, 0, 0, 5e4, 1.0, 3e3)
INITIATED = Outcome.STARTED
EXPECTED: dict[str, tuple[list[Row], list[Outcome]]] = {
    "no aircraft": ([(-1, 1.0, 0, 0, 5e4, 1.0, 3e3)], [Outcome.UNASSOCIATED]),
    "no free slot": ([(-2, 1.0, 0, 0, 5e4, 1.0, 3e3)], [Outcome.NO_ROOM]),
    "a first time without end": ([(0, np.inf, 0, 0, 5e4, 1.0, 3e3)], [Outcome.REFUSED]),
    "a time that is none": (
        [START, (0, np.nan, 0, 0, 5e4, 1.0, 3e3)],
        [INITIATED, Outcome.REFUSED],
    ),
    "a time without end": ([START, (0, np.inf, 0, 0, 5e4, 1.0, 3e3)], [INITIATED, Outcome.REFUSED]),
    "a first range too large": ([(0, 1.0, 0, 0, 1e13, 1.0, 3e3)], [Outcome.UNLOCATABLE]),
    "a later range too large": (
        [START, (0, 5.0, 0, 0, 1e13, 1.0, 3e3)],
        [INITIATED, Outcome.SINGULAR],
    ),
    "days of silence": ([START, (0, 2e5, 0, 0, 5e4, 1.0, 3e3)], [INITIATED, Outcome.RESTARTED]),
    "too early, time and again": (
        [START, *[(0, 0.5, 0, 0, 5e4, 1.0, 3e3)] * 4, (0, 5.0, 0, 0, 5e4, 1.0, 3e3)],
        [INITIATED, *[Outcome.REFUSED] * 4, Outcome.UPDATED],
    ),
    "a far plot, time and again": (
        [START, *[(0, 5.0, 0, 0, 9e4, 2.0, 3e3)] * 4],
        [INITIATED, *[Outcome.REFUSED] * 3, Outcome.RESTARTED],
    ),
}


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("case", EXPECTED)
def test_all_filters_give_the_same_outcome(name: str, case: str) -> None:
    sequence, expected = EXPECTED[case]
    assert outcomes_of(name, sequence) == expected


@pytest.mark.parametrize("name", FILTERS)
def test_a_first_bearing_is_unlocatable_or_unsupported(name: str) -> None:
    expected = Outcome.UNLOCATABLE if FILTERS[name].accepts_bearings else Outcome.UNSUPPORTED
    assert outcomes_of(name, [(0, 1.0, 2, 0, 5e4, 1.0, 3e3)]) == [expected]


# For covariance intersection biases are noise: no sensor is exact.
@pytest.mark.parametrize("name", sorted(FILTERS.keys() - {"ci"}))
def test_an_exact_state_is_restarted_after_singular_updates(name: str) -> None:
    exact: Row = (0, 1.0, 1, 2, 1e4, 1e4, 3e3)
    outcomes = outcomes_of(name, [exact] * 4 + [START])
    assert outcomes == [INITIATED, *[Outcome.SINGULAR] * 3, Outcome.RESTARTED]
