"""Translation of the biases at the end of a run, with their joint covariance."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.bias.store import BiasState, prior
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.wire.sensors import parameter_unit
from multiradar_schemas.products.bias import BIAS_CORRELATION_SCHEMA

Floats = NDArray[np.float64]

_NAMES = ("sensor_id", "parameter")


def bias_correlations_frame(covariance: Floats, sigma: Floats, table: SensorTable) -> pl.DataFrame:
    """Translate a covariance of biases to rows of `bias_correlations.parquet`.

    Parameters
    ----------
    covariance : (c, c) float64
        Covariance of the biases; its diagonal is not used.
    sigma : (c,) float64
        Their standard deviations in the last rows of `biases.parquet`, in m, rad, 1 or s.
    table : SensorTable
        The sensors.

    Returns
    -------
    DataFrame
        `BIAS_CORRELATION_SCHEMA`: each pair once.
    """
    first, second = np.triu_indices(len(sigma), 1)
    correlation = covariance[first, second] / (sigma[first] * sigma[second])
    columns = parameter_columns(table)
    return pl.DataFrame(
        {
            **{name: columns[name].gather(first) for name in _NAMES},
            **{f"other_{name}": columns[name].gather(second) for name in _NAMES},
            "correlation": np.clip(correlation, -1.0, 1.0),
        },
        schema=BIAS_CORRELATION_SCHEMA,
    )


def final_biases(
    biases: pl.DataFrame, correlations: pl.DataFrame, table: SensorTable
) -> tuple[BiasState, float | None]:
    """Translate the biases at the end of a run.

    Parameters
    ----------
    biases : DataFrame
        `BIAS_SCHEMA`, of the run; the last row of each bias counts.
    correlations : DataFrame
        `BIAS_CORRELATION_SCHEMA`, of the run.
    table : SensorTable
        The sensors to which the biases are to apply: a bias that the run did not estimate has its
        prior, one that is not estimated now is omitted.

    Returns
    -------
    state : BiasState
        Estimates and covariance, in the order of the table.
    time_s : float or None
        Data time of the estimates; None without any.
    """
    state = prior(table)
    columns = parameter_columns(table).with_row_index("column")
    last = biases.unique(list(_NAMES), keep="last", maintain_order=True)
    found = columns.join(last, on=list(_NAMES), how="inner", maintain_order="left")
    if found.is_empty():
        return state, None
    own = found["column"].to_numpy()
    unit = units(table)[own]
    state.estimate[own] = found["estimate"].to_numpy() * unit
    sigma = np.sqrt(np.diagonal(state.covariance)).copy()
    sigma[own] = found["sigma"].to_numpy() * unit
    correlation = np.eye(len(sigma))
    others = columns.rename({name: f"other_{name}" for name in _NAMES} | {"column": "other"})
    pairs = correlations.join(columns, on=list(_NAMES)).join(
        others, on=[f"other_{name}" for name in _NAMES]
    )
    rows, beside = pairs["column"].to_numpy(), pairs["other"].to_numpy()
    correlation[rows, beside] = correlation[beside, rows] = pairs["correlation"].to_numpy()
    state.covariance[:] = correlation * np.outer(sigma, sigma)
    return state, float(found["time_s"].max())  # type: ignore[arg-type]  # a column of numbers


def parameter_columns(table: SensorTable) -> pl.DataFrame:
    """Return `sensor_id` and `parameter` of each bias, in the order of the table."""
    return pl.DataFrame(
        {
            "sensor_id": [table.ids[one] for one in table.parameter_sensor.tolist()],
            "parameter": [PARAMETER_NAMES[one] for one in table.parameter_kind.tolist()],
        },
        schema={name: pl.String for name in _NAMES},
    )


def units(table: SensorTable) -> Floats:
    """Return the unit of each bias in files: radians for azimuths, 1 for others, (c,) float64."""
    names = parameter_columns(table)["parameter"]
    return np.array([parameter_unit(name) for name in names], np.float64)
