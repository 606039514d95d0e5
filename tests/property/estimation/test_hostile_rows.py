"""Whatever is handed in: an outcome for every row, and no number that is none in any state."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from multiradar.estimation.filters._step_kernels import BLOM, INTERSECTION, TWO_STAGE, step
from multiradar.estimation.filters.arrays import Model, Rows, Work, aircraft_arrays, result_arrays
from multiradar.estimation.filters.bank import Outcome
from multiradar.geodesy._kernels import plane_parameters, site_parameters
from multiradar.tracking.model import _options
from multiradar.tracking.settings import TrackingSettings

PLANE = plane_parameters(0.98, 1.06)
METHODS = {"two-stage": TWO_STAGE, "blom": BLOM, "ci": INTERSECTION}
#: A radar of each kind: as usual, one on a flat plane, and one that makes no errors at all.
SENSORS, COLUMNS = 3, 6

odd = st.sampled_from([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e308, -1e308, 5e-324, 1e150])
values = st.floats(1.0, 3e5) | odd
angles = st.floats(-4.0, 4.0) | odd
rows = st.tuples(
    st.integers(0, 1),
    st.floats(0.0, 60.0) | odd,
    st.sampled_from([0, 1, 3, 4]),
    st.integers(0, SENSORS - 1),
    values,
    angles,
    st.floats(0.0, 12e3) | odd,
)


def hostile_model(tracking: TrackingSettings) -> Model:
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
        places=np.arange(SENSORS),
        starts=np.arange(0, COLUMNS + 1, 2),
        parameters=np.tile([0, 1], SENSORS),
        bias=np.zeros(COLUMNS),
        bias_covariance=np.diag(sigmas**2),
        factor=np.diag(sigmas),
        options=_options(tracking),
    )


@pytest.mark.parametrize("name", sorted(METHODS))
@pytest.mark.parametrize("gated", [True, False])
@settings(max_examples=60, deadline=None)
@given(sequence=st.lists(rows, min_size=1, max_size=12))
@example([(0, 1.0, 4, 2, 1e4, 2e4, 0.0)] * 6)
@example([(0, 1.0, 3, 2, 5e4, 0.3, 0.0), (0, 0.5, 3, 2, 5e4, 0.3, 0.0)] * 3)
@example([(0, 1.0, 1, 0, 1e4, 0.0, np.inf), (0, 2.0, 1, 0, 1e308, 0.0, np.nan)])
def test_no_number_that_is_none_leaves_the_kernel(
    name: str, gated: bool, sequence: list[tuple[int, float, int, int, float, float, float]]
) -> None:
    tracking = TrackingSettings(filter_name=name)
    if not gated:
        tracking = TrackingSettings(
            filter_name=name, downweight_nis=np.inf, refuse_nis=np.inf, cone_ratio=0.0
        )
    slot, time, kind, sensor, z0, z1, height = (
        np.array(column) for column in zip(*sequence, strict=True)
    )
    given_rows = Rows(slot, time, kind, sensor, np.stack([z0, z1], axis=-1), height)
    count = len(slot)
    aircraft = aircraft_arrays(2, COLUMNS if name == "two-stage" else 0)
    result = result_arrays(count, 1, COLUMNS)
    work = Work(np.array([0]), np.array([0, count]), np.arange(count))
    step(METHODS[name], work, given_rows, hostile_model(tracking), aircraft, result, True)
    assert all(Outcome(code) in Outcome for code in result.outcome.tolist())
    for array in (aircraft.mean, aircraft.covariance, aircraft.sensitivity, aircraft.surprise):
        assert np.isfinite(array).all()
    assert (aircraft.covariance[:, [0, 4, 7, 9]] >= 0.0).all()
    for sums in (result.information, result.vector, result.log, result.readout[:, :8]):
        assert np.isfinite(sums).all()
    started = ~np.isnan(aircraft.time)
    assert np.isfinite(aircraft.time[started]).all()
    assert not np.isinf(aircraft.height).any()
