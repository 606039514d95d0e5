"""`reported_biases.parquet`: biases of radars that another SDPS reports (063), as priors.

By the formulas of the standard a bias is measured minus true, as here: true range = (measured −
offset) / (1 + gain).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.gathering import Rows
from multiradar_converters.asterix.decoding.naming import named
from multiradar_converters.asterix.decoding.sensor_status import SENSOR, TIME
from multiradar_converters.asterix.layout.columns import Numbers
from multiradar_schemas.sensors.sensor import BIAS_PARAMETERS

SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "processor_id": pl.String(),
        "sensor_id": pl.String(),
        "parameter": pl.String(),
        "estimate": pl.Float64(),
    }
)

_PRIMARY = "psr_"
# Figures of `FIELDS`: the parameter of each, and its unit in that of the figure.
_PARAMETERS = {
    "time_stamping_bias_ms": ("time_offset_s", 1e-3),
    "ssr_range_gain": ("range_gain", 1.0),
    "ssr_range_bias_nm": ("range_offset_m", 1852.0),
    "ssr_azimuth_bias_deg": ("azimuth_offset_deg", 1.0),
    "psr_range_gain": (_PRIMARY + "range_gain", 1.0),
    "psr_range_bias_nm": (_PRIMARY + "range_offset_m", 1852.0),
    "psr_azimuth_bias_deg": (_PRIMARY + "azimuth_offset_deg", 1.0),
    "psr_elevation_bias_deg": (_PRIMARY + "elevation_offset_deg", 1.0),
}
# Last bit of each parameter in category 063, and an allowance for what that processor does not
# know: it models and anchors the same radar differently. Neither has a sigma there.
_LAST_BIT = {
    "range_offset_m": 1852.0 / 128,
    "azimuth_offset_deg": 360.0 / 65536,
    "range_gain": 1e-5,
    "time_offset_s": 1e-3,
}
_ALLOWANCE = {
    "range_offset_m": 20.0,
    "azimuth_offset_deg": 0.02,
    "range_gain": 1e-4,
    "time_offset_s": 0.05,
}
# Decimals that the last bit justifies.
_DIGITS = {"range_offset_m": 1, "azimuth_offset_deg": 4, "range_gain": 6, "time_offset_s": 3}


@dataclass(frozen=True, slots=True)
class ReportedBias:
    """A bias of a radar as another processor reports it.

    Attributes
    ----------
    processor_id, sensor_id : str
        `SAC-SIC` of the processor and of the radar.
    parameter : str
        As in `biases.parquet`; of primary plots with `psr_` before it.
    reports : int
        Number of reports.
    estimate : float
        The last report, measured minus true, in the unit of the parameter.
    spread : float
        RMS difference of all reports from the last.
    prior_sigma : float or None
        Sigma for its use as a prior: spread, rounding, and 20 m, 0.02°, 10⁻⁴ or 0.05 s. None for
        parameters of primary plots.
    """

    processor_id: str
    sensor_id: str
    parameter: str
    reports: int
    estimate: float
    spread: float
    prior_sigma: float | None

    def toml_line(self) -> str:
        """Return the prior as a line of `sensors.toml`."""
        digits = _DIGITS[self.parameter]
        return (
            f"bias.{self.parameter} = {{ prior = {self.estimate:.{digits}f}, "
            f"prior_sigma = {self.prior_sigma:.{digits}f} }}"
        )


def frame(
    parts: Sequence[tuple[Rows, pl.DataFrame]], times_s: Sequence[Numbers], start_s: float
) -> pl.DataFrame:
    """Return the biases in the sensor status of a file.

    Parameters
    ----------
    parts : sequence of (Rows, DataFrame)
        Location of the records, and the result of `read_status`.
    times_s : sequence of float64[n]
        Their times, see `FileDays.status_s`.
    start_s : float
        Added to times, s.

    Returns
    -------
    DataFrame
        Columns of `SCHEMA`, one row per parameter, in file order; `time_s` is null where the
        record has no time, or one more than an hour from its neighbours.
    """
    if not parts:
        return pl.DataFrame(schema=SCHEMA)
    order = np.argsort(np.concatenate([rows.order for rows, _ in parts]), kind="stable")
    source = np.concatenate([rows.source for rows, _ in parts])[order]
    status = pl.concat([part for _, part in parts])[order.tolist()]
    dated = np.concatenate(times_s)[order] + start_s
    scaled = [
        (pl.col(name) * unit).alias(parameter) for name, (parameter, unit) in _PARAMETERS.items()
    ]
    made: pl.DataFrame = (
        status.with_columns(
            pl.Series(TIME, dated, nan_to_null=True),
            named(source, source_name).alias("processor_id"),
        )
        .drop_nulls(SENSOR)
        .select(TIME, "processor_id", SENSOR, *scaled)
        .with_row_index("record")
        .unpivot(index=["record", TIME, "processor_id", SENSOR], value_name="estimate")
        .rename({"variable": "parameter"})
        .drop_nulls("estimate")
        .sort("record", maintain_order=True)
        .select(SCHEMA.names())
    )
    return made


def in_order(parts: Sequence[pl.DataFrame]) -> pl.DataFrame:
    """Return the biases of all parts of a recording by time, without duplicates.

    Parameters
    ----------
    parts : sequence of DataFrame
        Columns of `SCHEMA`.
    """
    whole = pl.concat([pl.DataFrame(schema=SCHEMA), *parts])
    return whole.unique(maintain_order=True).sort("time_s", maintain_order=True)


def write(path: Path, table: pl.DataFrame) -> int:
    """Write the table; return its rows. No file without rows."""
    if table.height:
        table.write_parquet(path, compression="snappy", statistics=True)
    return table.height


def reported_biases(table: pl.DataFrame) -> list[ReportedBias]:
    """Return what the reports say of each parameter, by processor, radar and parameter.

    Parameters
    ----------
    table : DataFrame
        Columns of `SCHEMA`, in order of time.

    Returns
    -------
    list of ReportedBias
        Gains and time offsets that are 0 in all reports are omitted: processors that do not
        estimate them report 0.
    """
    last = pl.col("estimate").last()
    found = table.group_by("processor_id", "sensor_id", "parameter", maintain_order=True).agg(
        pl.len().alias("reports"),
        last.alias("last"),
        ((pl.col("estimate") - last) ** 2).mean().sqrt().alias("spread"),
        (pl.col("estimate") != 0.0).any().alias("estimated"),
    )
    offsets = pl.col("parameter").str.contains("range_offset|azimuth_offset")
    return [
        ReportedBias(
            processor_id=row["processor_id"],
            sensor_id=row["sensor_id"],
            parameter=row["parameter"],
            reports=row["reports"],
            estimate=row["last"],
            spread=row["spread"],
            prior_sigma=_prior_sigma(row["parameter"], row["spread"]),
        )
        for row in found.filter(offsets | pl.col("estimated")).to_dicts()
    ]


def prior_lines(reported: Sequence[ReportedBias], sensor_id: str) -> list[str]:
    """Return comment lines of `sensors.toml` that offer reported biases as priors of a radar."""
    lines: list[str] = []
    own = [
        one for one in reported if one.sensor_id == sensor_id and one.parameter in BIAS_PARAMETERS
    ]
    for processor in dict.fromkeys(one.processor_id for one in own):
        biases = [one for one in own if one.processor_id == processor]
        biases.sort(key=lambda one: BIAS_PARAMETERS.index(one.parameter))
        lines.append(
            f"# Reported by {processor} (category 063): priors that can replace the ones above."
        )
        lines += [f"# {one.toml_line()}" for one in biases]
    return lines


def _prior_sigma(parameter: str, spread: float) -> float | None:
    if parameter not in _LAST_BIT:
        return None
    rounding = _LAST_BIT[parameter] / np.sqrt(12.0)
    return float(np.sqrt(spread**2 + rounding**2 + _ALLOWANCE[parameter] ** 2))
