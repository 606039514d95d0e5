"""The biases of the days of a region: by day, from day to day, and over the period."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.estimation.bias.days import (
    ChiSquare,
    OwnEstimate,
    OwnInformation,
    line,
    merged,
    own_estimate,
    own_information,
    scatter,
    step,
)
from multiradar.estimation.bias.store import BiasState, drift, prior
from multiradar.toolbox.run import Run
from multiradar.toolbox.tracking.earlier_run import biases_at_end
from multiradar.toolbox.tracking.reprocessing.days import Day
from multiradar.toolbox.tracking.reprocessing.records import DayRecord
from multiradar_schemas.products.bias_days import (
    BIAS_OF_DAY_SCHEMA,
    BIAS_OF_PERIOD_SCHEMA,
    BIAS_STEP_SCHEMA,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from multiradar.estimation.measurement.sensors import SensorTable

BY_DAY_FILE, STEPS_FILE, MERGED_FILE = (
    "biases_by_day.parquet", "drift.parquet", "biases_merged.parquet",
)  # fmt: skip
_DAY_S = 86_400.0

#: Tables by file.
Frames = dict[str, pl.DataFrame]


@dataclass(frozen=True, slots=True)
class _DayBiases:
    day: Day
    time_s: float
    end: BiasState
    information: OwnInformation
    own: OwnEstimate


class Period:
    """The biases of the days of a region.

    Parameters
    ----------
    region : str
        Its name; empty without regions.
    days : sequence of (Day, Path, DayRecord)
        Completed days in the order of time, with their output.
    sensors : SensorTable
        The sensors of the region.
    """

    def __init__(
        self,
        region: str,
        days: Sequence[tuple[Day, Path, DayRecord]],
        sensors: "SensorTable",
    ) -> None:
        self._region, self._sensors = region, sensors
        outputs = {day.date: out for day, out, _ in days}
        self._days = [self._of_day(*one, outputs) for one in days]
        self._units = wire.units(sensors)
        self._names = wire.parameter_columns(sensors).rows()

    def frames(self) -> Frames:
        """Return the rows of the region of each table."""
        return {
            BY_DAY_FILE: pl.DataFrame(self._by_day(), schema=BIAS_OF_DAY_SCHEMA, orient="row"),
            STEPS_FILE: pl.DataFrame(self._steps(), schema=BIAS_STEP_SCHEMA, orient="row"),
            MERGED_FILE: pl.DataFrame(self._merged(), schema=BIAS_OF_PERIOD_SCHEMA, orient="row"),
        }

    def tests(self) -> list[dict[str, Any]]:
        """Return whether biases are the same on all days: of the region and of each sensor.

        Their correlations are used. Only biases that all days determine are tested.
        """
        if len(self._days) < 2:
            return []
        always = np.logical_and.reduce([one.own.determined for one in self._days])
        owners = self._sensors.parameter_sensor
        chosen = {"": np.flatnonzero(always)} | {
            name: np.flatnonzero(always & (owners == number))
            for number, name in enumerate(self._sensors.ids)
        }
        return [
            {"region": self._region, "sensor_id": name, "days": len(self._days)}
            | _document(scatter([one.own for one in self._days], columns))
            for name, columns in chosen.items()
            if len(columns)
        ]

    def _of_day(
        self, day: Day, out: Path, record: DayRecord, outputs: Mapping[str, Path]
    ) -> _DayBiases:
        run, sensors = Run(out), self._sensors
        end = wire.final_biases(run.biases, run.table("bias_correlations"), sensors)[0]
        start = prior(sensors)
        if record.start:
            start = biases_at_end(Run(outputs[record.start]), sensors, record.first_s)
        length_s = record.last_s - record.first_s
        if length_s > 0.0:
            start = drift(start, sensors.drift, length_s)[0]
        information = own_information(start, end)
        time_s = (record.first_s + record.last_s) / 2.0
        return _DayBiases(day, time_s, end, information, own_estimate(information))

    def _by_day(self) -> list[tuple[Any, ...]]:
        return [
            (
                self._region, one.day.date, *name, one.time_s,
                one.end.estimate[column] / unit, one.end.sigma[column] / unit,
                *(
                    (one.own.value[column] / unit, one.own.sigma[column] / unit)
                    if one.own.determined[column]
                    else (None, None)
                ),
            )
            for one in self._days
            for column, (name, unit) in enumerate(zip(self._names, self._units, strict=True))
        ]  # fmt: skip

    def _steps(self) -> list[tuple[Any, ...]]:
        rows = []
        for column, (name, unit) in enumerate(zip(self._names, self._units, strict=True)):
            for before, after in pairwise(self._determining(column)):
                test = step(before.own, after.own, np.array([column]))
                difference = after.own.value[column] - before.own.value[column]
                sigma = np.hypot(before.own.sigma[column], after.own.sigma[column])
                rows.append(
                    (
                        self._region, *name, before.day.date, after.day.date,
                        (after.time_s - before.time_s) / _DAY_S, difference / unit, sigma / unit,
                        test.statistic, test.p_value,
                    )
                )  # fmt: skip
        return rows

    def _merged(self) -> list[tuple[Any, ...]]:
        if not self._days:
            return []
        together = merged([one.information for one in self._days], prior(self._sensors))
        return [
            (
                self._region, *name, len(self._determining(column)),
                together.estimate[column] / unit, together.sigma[column] / unit,
                *self._over_time(column, unit),
            )
            for column, (name, unit) in enumerate(zip(self._names, self._units, strict=True))
        ]  # fmt: skip

    # χ², degrees of freedom and p-value of a constant; slope, sigma and p-value; χ² and p-value of
    # the line.
    def _over_time(self, column: int, unit: float) -> tuple[Any, ...]:
        days = self._determining(column)
        if len(days) < 2:
            return (None, 0, *[None] * 6)
        own = [one.own for one in days]
        constant = scatter(own, np.array([column]))
        fitted = line(
            _numbers([one.time_s / _DAY_S for one in days]),
            _numbers([one.value[column] for one in own]),
            _numbers([one.sigma[column] for one in own]),
        )
        about: tuple[float | None, ...] = (fitted.about.statistic, fitted.about.p_value)
        return (
            constant.statistic, constant.degrees_of_freedom, constant.p_value,
            fitted.slope / unit, fitted.sigma / unit, fitted.drift.p_value,
            *(about if fitted.about.degrees_of_freedom else (None, None)),
        )  # fmt: skip

    def _determining(self, column: int) -> list[_DayBiases]:
        return [one for one in self._days if one.own.determined[column]]


def _numbers(values: Sequence[float]) -> "NDArray[np.float64]":
    return np.array(values, np.float64)


def _document(test: ChiSquare) -> dict[str, Any]:
    return {
        "chi2": test.statistic,
        "degrees_of_freedom": test.degrees_of_freedom,
        "p_value": test.p_value,
    }
