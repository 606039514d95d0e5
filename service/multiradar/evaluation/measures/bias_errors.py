"""Estimated biases of radars against the true ones."""

from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar.errors import InputError, MissingColumnError
from multiradar.evaluation.trajectories import NUMBER_MAX, Floats

BIAS_COLUMNS = ("time_s", "sensor_id", "parameter", "estimate", "sigma")
TRUE_BIAS_COLUMNS = ("time_s", "sensor_id", "parameter", "value")


@dataclass(frozen=True, slots=True, eq=False)
class BiasHistory:
    """One bias over time, in the unit of its parameter.

    Attributes
    ----------
    sensor_id, parameter : str
        Sensor and bias parameter.
    time_s, estimate, sigma : (n,) float64
        Published by the tracker.
    true : (n,) float64
        The truth, interpolated linearly; NaN where unknown.
    """

    sensor_id: str
    parameter: str
    time_s: Floats
    estimate: Floats
    sigma: Floats
    true: Floats

    @property
    def last(self) -> int:
        """Row of the last estimate with a known truth, or of the last estimate."""
        known = np.flatnonzero(np.isfinite(self.true))
        return int(known[-1]) if len(known) else len(self.time_s) - 1


def bias_histories(
    biases: pl.DataFrame, source: str, truth: pl.DataFrame | None, truth_source: str
) -> list[BiasHistory]:
    """Return estimated biases with their truth.

    Parameters
    ----------
    biases : DataFrame
        `biases.parquet`.
    source, truth_source : str
        Names used in errors.
    truth : DataFrame, optional
        `truth_biases.parquet`; without it the truth is unknown.

    Returns
    -------
    list of BiasHistory
        By sensor, then parameter.

    Raises
    ------
    MissingColumnError
        A column is missing.
    InputError
        A column is not numeric.
    """
    _require(biases, BIAS_COLUMNS, source)
    if truth is not None:
        _require(truth, TRUE_BIAS_COLUMNS, truth_source)
    found = []
    for (sensor, parameter), rows in sorted(
        biases.sort("time_s").partition_by("sensor_id", "parameter", as_dict=True).items(),
        key=lambda item: tuple(map(str, item[0])),
    ):
        time_s, estimate, sigma = (
            rows[name].cast(pl.Float64).to_numpy() for name in ("time_s", "estimate", "sigma")
        )
        true = np.full(len(time_s), np.nan)
        if truth is not None:
            own = truth.filter(
                (pl.col("sensor_id") == sensor) & (pl.col("parameter") == parameter)
            ).sort("time_s")
            true = _between(time_s, own) if len(own) else true
        found.append(BiasHistory(str(sensor), str(parameter), time_s, estimate, sigma, true))
    return found


def _between(time_s: Floats, truth: pl.DataFrame) -> Floats:
    when, value = truth["time_s"].to_numpy(), truth["value"].to_numpy()
    true: Floats = np.interp(time_s, when, value, left=np.nan, right=np.nan)
    return true


def _require(frame: pl.DataFrame, columns: tuple[str, ...], source: str) -> None:
    missing = [name for name in columns if name not in frame.columns]
    if missing:
        raise MissingColumnError(source, missing, frame.columns)
    for name in columns:
        text = name in {"sensor_id", "parameter"}
        values = frame[name]
        good = values.dtype == pl.String() if text else values.dtype.is_numeric()
        if good and not text:
            good = bool(values.cast(pl.Float64).is_between(-NUMBER_MAX, NUMBER_MAX).all())
        if not good or values.null_count():
            what = "text" if text else "a number"
            msg = f"{source}: {name}: expected {what} in every row, was {values.dtype}"
            raise InputError(msg)
