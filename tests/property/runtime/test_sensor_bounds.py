"""Whatever sensor the bounds let in, what comes out of every filter is numbers."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.estimation.filters.bank import FILTERS
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame
from multiradar.simulation.scenario.file import scenario_of, scenario_table
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas import bounds as bounds
from multiradar_schemas.bounds import Bounds, ParameterBounds
from multiradar_schemas.sensors.sensor import parse_sensors

PARAMETERS = {
    "range_offset_m": bounds.RANGE_OFFSET_M,
    "azimuth_offset_deg": bounds.AZIMUTH_OFFSET_DEG,
    "range_gain": bounds.RANGE_GAIN,
    "time_offset_s": bounds.TIME_OFFSET_S,
}
# Only one filter estimates offsets of time.
FILTERS_OF_TIME = ("two-stage",)


def _corner(within: Bounds) -> st.SearchStrategy[float]:
    return st.sampled_from([within.least, within.most])


def _bias(limits: ParameterBounds, small: float) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries(
        {
            "value": st.sampled_from([0.0, small]),
            "prior": st.sampled_from([-limits.value, 0.0, limits.value]),
            "prior_sigma": _corner(limits.sigma),
            "assumed_drift": st.sampled_from([0.0, limits.drift]),
            "estimate": st.just(True),
        }
    )


def _radar(name: str, *, clocks: bool) -> st.SearchStrategy[dict[str, Any]]:
    small = {"range_offset_m": 300.0, "azimuth_offset_deg": 0.3, "range_gain": 1e-3}
    biases = {one: _bias(PARAMETERS[one], value) for one, value in small.items()}
    if clocks:
        biases["time_offset_s"] = _bias(bounds.TIME_OFFSET_S, 0.4)
    return st.fixed_dictionaries(
        {
            "id": st.just(name),
            "east_m": st.sampled_from([-6e4, 5e4]),
            "north_m": st.sampled_from([-3e4, 4e4]),
            "height_m": _corner(bounds.HEIGHT_M),
            "range_sigma_m": _corner(bounds.RANGE_SIGMA_M),
            "azimuth_sigma_deg": _corner(bounds.AZIMUTH_SIGMA_DEG),
            "interval_s": st.just(2.0),
            "horizon": st.just(False),
            "bias": st.fixed_dictionaries(biases),
        }
    )


def _adsb() -> st.SearchStrategy[dict[str, Any]]:
    sigma = _corner(bounds.POSITION_SIGMA_M)
    fixed = {"id": st.just("adsb"), "kind": st.just("adsb"), "interval_s": st.just(3.0)}
    return st.fixed_dictionaries(fixed | {"position_sigma_m": sigma})


def _sensors(*, clocks: bool) -> st.SearchStrategy[list[dict[str, Any]]]:
    first, second = (_radar(name, clocks=clocks) for name in ("a", "b"))
    both = st.tuples(first, second).map(list)
    anchored = st.tuples(first, second, _adsb()).map(list)
    return both | anchored


def _outputs(sensors: list[dict[str, Any]], filter_name: str) -> tuple[Engine, list[EngineOutput]]:
    traffic = {"count": 4, "east_m": [-8e4, 8e4], "north_m": [-8e4, 8e4]}
    place = {"latitude_deg": 50.0, "longitude_deg": 10.0}
    values = {"duration_s": 40.0, "plane": place, "traffic": [traffic], "sensor": sensors}
    scene = scenario_of(scenario_table(values, source="the test"))
    seen = observe(scene, np.random.Generator(np.random.PCG64(11)))
    table = sensor_table(parse_sensors(sensors_text(scene)))
    batch, _ = measurement_batch(measurements_frame(scene, seen), table)
    engine = Engine(table, TrackingSettings(filter_name=filter_name))
    return engine, [engine.push(batch), engine.flush()]


def _require_numbers(sensors: list[dict[str, Any]], filter_name: str) -> None:
    engine, outputs = _outputs(sensors, filter_name)
    for output in outputs:
        for name in (
            "latitude_rad", "longitude_rad", "speed_mps", "heading_rad", "position_sigma_m",
            "velocity_sigma_mps",
        ):  # fmt: skip
            assert np.isfinite(getattr(output.updates, name)).all(), name
        assert np.isfinite(output.biases.estimate).all()
        assert np.isfinite(output.biases.sigma).all()
    tracks = engine.tracks()
    assert np.isfinite(tracks.mean).all()
    assert np.isfinite(tracks.covariance).all()
    engine.close()


@pytest.mark.parametrize("filter_name", FILTERS)
@settings(max_examples=12)
@given(sensors=_sensors(clocks=False))
def test_nothing_within_the_bounds_gives_what_is_no_number(
    filter_name: str, sensors: list[dict[str, Any]]
) -> None:
    _require_numbers(sensors, filter_name)


@pytest.mark.parametrize("filter_name", FILTERS_OF_TIME)
@settings(max_examples=12)
@given(sensors=_sensors(clocks=True))
def test_nor_do_offsets_of_time(filter_name: str, sensors: list[dict[str, Any]]) -> None:
    _require_numbers(sensors, filter_name)
