"""Whatever the values of a recording, a run ends with finite tracks and findings about sensors."""

from functools import cache
from typing import NamedTuple, cast

import numpy as np
import polars as pl
import polars.selectors as cs
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import multiradar as mr
from multiradar.errors import FindingsError
from multiradar.toolbox.run import Run
from multiradar.toolbox.simulation import Simulation
from multiradar_schemas.measurements.measurement import TIME_MAX_S

#: Radars, direction finders, positions and reports of aircraft.
SCENES = ("jamming", "late-reports", "aircraft-data")
#: The least and the greatest value, and one beyond.
EXTREMES = {
    "range_m": (1e-3, 7e5, -1.0),
    "azimuth_deg": (0.0, 359.999999, -90.0),
    "latitude_deg": (-90.0, 90.0, 91.0),
    "longitude_deg": (-180.0, 180.0, 200.0),
    "height_m": (-1000.0, 30_000.0, 1e5),
    "vertical_rate_m_s": (-160.0, 160.0, 1e3),
    "ground_speed_m_s": (0.0, 1000.0, -1.0),
    "roll_deg": (-90.0, 90.0, 200.0),
}
STARTS_S = (0.0, -300.0, 86_390.0, 1.79e9, -TIME_MAX_S + 1e4, TIME_MAX_S - 1e4, 2.0 * TIME_MAX_S)


class Edit(NamedTuple):
    """A value of one column, in a fraction of the rows."""

    column: str
    value: float
    share: float


edits = st.sampled_from(list(EXTREMES)).flatmap(
    lambda column: st.builds(
        Edit, st.just(column), st.sampled_from(EXTREMES[column]), st.sampled_from([0.02, 0.5])
    )
)


@cache
def _scene(name: str) -> Simulation:
    return mr.simulate(name, duration_s=60.0, seed=1)


def _edited(frame: pl.DataFrame, start_s: float, made: list[Edit]) -> pl.DataFrame:
    time = pl.col("time_s") - pl.col("time_s").min() + start_s
    rng = np.random.default_rng(len(made))
    for column, value, share in made:
        if column in frame.columns:
            chosen = pl.Series(rng.random(len(frame)) < share) & frame[column].is_not_null()
            frame = frame.with_columns(
                pl.when(chosen).then(value).otherwise(pl.col(column)).alias(column)
            )
    return frame.with_columns(time_s=time)


def _tracked(scene: Simulation, frame: pl.DataFrame, *, hidden: bool) -> Run:
    hide = ["track_number"] if hidden else None
    try:
        return mr.track(frame, scene.sensors, hide=hide, encounters=60.0, forecasts=20.0)
    except FindingsError as error:
        return cast(Run, error.output)


# Such as that the times are in the future.
@pytest.mark.filterwarnings("ignore::multiradar.errors.DataWarning")
@settings(max_examples=10)
@given(
    name=st.sampled_from(SCENES),
    start_s=st.sampled_from(STARTS_S),
    made=st.lists(edits, max_size=3),
    hidden=st.booleans(),
)
@example(name="jamming", start_s=2.0 * TIME_MAX_S, made=[], hidden=False)
@example(name="jamming", start_s=0.0, made=[Edit("azimuth_deg", -90.0, 0.5)], hidden=False)
@example(name="aircraft-data", start_s=-TIME_MAX_S + 1e4, made=[], hidden=True)
def test_a_run_ends_with_finite_tracks_and_findings(
    name: str, start_s: float, made: list[Edit], *, hidden: bool
) -> None:
    scene = _scene(name)
    done = _tracked(scene, _edited(scene.measurements, start_s, made), hidden=hidden)
    counts = done.report["counts"]
    assert counts["read"] == scene.measurements.height
    assert counts["read"] == sum(counts[one] for one in ("accepted", "rejected", "duplicate"))
    numbers = done.tracks.select(cs.float()).fill_null(0.0)
    assert bool(numbers.select(pl.all_horizontal(pl.all().is_finite().all())).item())
