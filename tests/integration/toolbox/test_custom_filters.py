"""A filter of one aircraft that a user registers, evaluated like the others."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

import multiradar as mr
from multiradar.errors import CovarianceError, ShapeError
from multiradar.toolbox.tracking.custom_filters import AircraftPlot

Floats = NDArray[np.float64]


class Straight:
    """A Kalman filter of constant velocity."""

    density = 30.0

    def __init__(self) -> None:
        self._time_s = np.nan
        self._state, self._covariance = np.zeros(4), np.diag([0.0, 0.0, 300.0**2, 300.0**2])

    def update(self, plot: AircraftPlot) -> tuple[Floats, Floats]:
        if np.isnan(self._time_s):
            self._state[:2], self._covariance[:2, :2] = plot.position_m, plot.covariance_m2
        else:
            self._predict(plot.time_s - self._time_s)
            spread = self._covariance[:2, :2] + plot.covariance_m2
            gain = self._covariance[:, :2] @ np.linalg.inv(spread)
            self._state = self._state + gain @ (plot.position_m - self._state[:2])
            left = self._covariance - gain @ spread @ gain.T
            self._covariance = (left + left.T) / 2.0
        self._time_s = plot.time_s
        return self._state, self._covariance

    def _predict(self, step_s: float) -> None:
        moved = np.eye(4) + step_s * np.eye(4, k=2)
        noise = [[step_s**3 / 3.0, step_s**2 / 2.0], [step_s**2 / 2.0, step_s]]
        self._state = moved @ self._state
        self._covariance = moved @ self._covariance @ moved.T
        self._covariance += self.density * np.kron(noise, np.eye(2))


class Sluggish(Straight):
    """One that hardly believes in manoeuvres."""

    density = 1e-4


@pytest.fixture(scope="module")
def scores(made: Path) -> dict[str, float]:
    mr.register_filter("straight", Straight)
    mr.register_filter("sluggish", Sluggish)
    scores = {}
    for name in ("straight", "sluggish", "imm"):
        done = mr.track(made / "scene", made / "scene" / "sensors.toml", filter=name)
        card = mr.evaluate(done, truth=made / "scene", settling_s=30.0)
        scores[name] = float(card.figures["errors"]["position_m"]["rms"])
    return scores


def test_a_registered_filter_is_evaluated_as_the_others(scores: dict[str, float]) -> None:
    # Plots have 50 m; a filter with plausible noise is near the compiled one.
    assert scores["straight"] < 2.0 * scores["imm"]
    assert scores["sluggish"] != scores["straight"]


def test_its_states_replace_those_of_the_host_and_nothing_else(made: Path, tracked: mr.Run) -> None:
    mr.register_filter("straight", Straight)
    done = mr.track(made / "scene", made / "scene" / "sensors.toml", filter="straight")
    own = {
        "latitude_deg", "longitude_deg", "speed_mps", "heading_deg", "position_sigma_m",
        "velocity_sigma_mps", "turn_right_probability", "turn_left_probability",
        "speed_change_probability",
    }  # fmt: skip
    kept = [name for name in tracked.tracks.columns if name not in own]
    assert done.tracks.select(kept).equals(tracked.tracks.select(kept))
    assert done.biases.equals(tracked.biases)
    assert not done.tracks["speed_mps"].equals(tracked.tracks["speed_mps"])
    assert done.report["output_sha256"] != tracked.report["output_sha256"]
    settings = done.report["settings"]
    assert (settings["filter_name"], settings["host_filter"]) == ("straight", "imm")


def test_a_tracker_uses_it_as_well(made: Path) -> None:
    mr.register_filter("straight", Straight)
    sensors = made / "scene" / "sensors.toml"
    done = mr.track(made / "scene", sensors, filter="straight")
    with mr.Tracker(sensors, filter="straight") as tracker:
        frame = pl.read_parquet(made / "scene" / "measurements.parquet")
        parts = [tracker.push(frame), tracker.flush()]
    assert pl.concat([part.tracks for part in parts]).equals(done.tracks)


class Wrong:
    """Returns what is no covariance."""

    found: object = (np.zeros(4), -np.eye(4))

    def update(self, plot: AircraftPlot) -> object:
        del plot
        return self.found


@pytest.mark.parametrize(
    ("found", "kind", "sentence"),
    [
        ((np.zeros(4), -np.eye(4)), CovarianceError, r"filter wrong, track 1: covariance.* at "),
        ((np.zeros(3), np.eye(4)), ShapeError, "filter wrong, track 1: state: expected"),
        ((np.full(4, np.nan), np.eye(4)), ShapeError, "filter wrong, track 1: state: expected"),
        (None, ShapeError, "filter wrong, track 1: update: .* state and a covariance, was None"),
        (np.zeros(4), ShapeError, "filter wrong, track 1: update: .*, was ndarray of 4"),
        ((np.zeros(4),), ShapeError, "filter wrong, track 1: update: .*, was tuple of 1"),
    ],
)
def test_what_it_returns_is_checked(
    made: Path, found: object, kind: type[Exception], sentence: str
) -> None:
    class One(Wrong):
        """With this result."""

    One.found = found
    mr.register_filter("wrong", One)  # type: ignore[arg-type]  # on purpose
    with pytest.raises(kind, match=sentence):
        mr.track(made / "scene", made / "scene" / "sensors.toml", filter="wrong")
