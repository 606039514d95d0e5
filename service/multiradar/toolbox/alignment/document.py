"""The figures of a registration."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.cross_validation import (
    AIRCRAFT_MIN,
    distances,
    middle_and_spread,
    side_of,
)
from multiradar.diagnosis.alignment.pairs import APART_MAX_S
from multiradar.diagnosis.alignment.trends import SIGMAS
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.bias.observability import unobservable_combinations
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_NAMES,
    PARAMETER_UNITS,
    SensorTable,
)
from multiradar.toolbox.alignment.registration import Registration
from multiradar.toolbox.alignment.sensors_file import aligned_sensors
from multiradar_schemas.alignment import (
    AlignedBias,
    AlignedDistances,
    AlignedInput,
    AlignedInterval,
    AlignedPair,
    AlignedRadar,
    AlignedResiduals,
    AlignedUnobservable,
    Alignment,
)
from multiradar_schemas.report import Counts
from multiradar_schemas.sensors.sensor import SensorsFile

#: Aircraft below which the sigma of a radar is not reliable.
AIRCRAFT_FEW = 10


def alignment_of(
    found: Registration,
    inputs: Sequence[AlignedInput],
    span_s: tuple[float, float] | None,
    sensors: SensorsFile,
    command: str,
) -> Alignment:
    """Return the figures of a registration.

    Parameters
    ----------
    found : Registration
        The result.
    inputs : sequence of AlignedInput
        The recordings.
    span_s : tuple of float, optional
        First and last time of the measurements, s.
    sensors : SensorsFile
        The sensors file.
    command : str
        The command line, for the comment of the new sensors file.
    """
    tracked = found.tracked
    every = np.arange(found.problem.pairs.size)
    biases = _biases(found)
    radars = [one for one in _sensors(found) if found.sensors.kinds[one] == KIND_RADAR]
    by_radar = [_radar(found, one) for one in radars]
    names = found.sensors.ids
    return Alignment(
        inputs=[*inputs],
        counts=Counts(
            read=tracked.read,
            accepted=tracked.accepted,
            rejected=tracked.rejected_total,
            duplicate=tracked.duplicate,
        ),
        first_s=None if span_s is None else span_s[0],
        last_s=None if span_s is None else span_s[1],
        tracks=tracked.tracks_confirmed,
        track_fraction=found.track_fraction,
        folds=len(np.unique(found.validation.fold)),
        pair_time_s=APART_MAX_S,
        residuals=_residuals(found, every),
        biases=biases,
        radars=by_radar,
        pairs=[
            AlignedPair(
                first=names[one.first], second=names[one.second],
                residuals=_residuals(found, one.rows),
            )
            for one in found.problem.groups
        ],
        unobservable=[
            AlignedUnobservable(what=one.name, prior_ratio=one.prior_ratio)
            for one in unobservable_combinations(found.sensors, found.whole.covariance)
        ],
        trend=_trend(found),
        warnings=_warnings(found, by_radar),
        sensors_toml=aligned_sensors(sensors, biases, command),
    )  # fmt: skip


def unit_of(sensors: SensorTable, column: int) -> float:
    """Return the factor from the unit of the core to that of the file: degrees for azimuths."""
    return 1.0 / float(PARAMETER_UNITS[sensors.parameter_kind[column]])


def _sensors(found: Registration) -> list[int]:
    pairs = found.problem.pairs
    used = np.unique(np.concatenate([pairs.first_sensor, pairs.second_sensor])).tolist()
    radars = np.flatnonzero(np.asarray(found.sensors.kinds) == KIND_RADAR).tolist()
    return sorted({*used, *radars})


def _residuals(found: Registration, rows: NDArray[np.intp]) -> AlignedResiduals:
    own = found.validation
    aircraft = len(np.unique(found.problem.pairs.aircraft[rows]))
    withheld = len(np.unique(own.fold)) >= AIRCRAFT_MIN
    return AlignedResiduals(
        pairs=len(rows),
        aircraft=aircraft,
        before=_distances(own.before[rows]),
        after=_distances(own.after[rows]) if withheld else None,
        best=_distances(own.best[rows]),
    )


def _distances(residual: Floats) -> AlignedDistances | None:
    if not len(residual):
        return None
    of = distances(residual)
    return AlignedDistances(
        median_m=of.median_m, rms_m=of.rms_m, percentile_90_m=of.percentile_90_m
    )


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _biases(found: Registration) -> list[AlignedBias]:
    table = found.sensors
    sigma = np.sqrt(np.diag(found.whole.covariance))
    rows = []
    for column in range(len(sigma)):
        unit = unit_of(table, column)
        drift, spread = found.trend.drift_per_h[column], found.trend.drift_sigma[column]
        rows.append(
            AlignedBias(
                sensor_id=table.ids[table.parameter_sensor[column]],
                parameter=PARAMETER_NAMES[table.parameter_kind[column]],
                estimate=float(found.whole.estimate[column] * unit),
                sigma=float(sigma[column] * unit),
                prior_ratio=float(sigma[column] / table.prior_sigma[column]),
                drift_per_h=_known(drift * unit),
                drift_sigma_per_h=_known(spread * unit),
                drifts=bool(np.abs(drift) > SIGMAS * spread),
            )
        )
    return rows


def _radar(found: Registration, number: int) -> AlignedRadar:
    own = side_of(found.problem, number)
    before = own.polar(found.validation.before)
    after = own.polar(found.validation.after)
    seen = len(own.rows) > 0
    ranges, azimuths = (middle_and_spread(one) for one in after)
    noise = found.whole.noise
    return AlignedRadar(
        sensor_id=found.sensors.ids[number],
        residuals=_residuals(found, own.rows),
        range_before_m=_known(middle_and_spread(before[0])[0]),
        range_after_m=_known(ranges[0]),
        range_spread_m=_known(ranges[1]),
        azimuth_before_deg=_known(np.degrees(middle_and_spread(before[1])[0])),
        azimuth_after_deg=_known(np.degrees(azimuths[0])),
        azimuth_spread_deg=_known(np.degrees(azimuths[1])),
        range_noise_m=float(np.sqrt(noise.range_m2[number])) if seen else None,
        azimuth_noise_deg=float(np.degrees(np.sqrt(noise.azimuth_rad2[number]))) if seen else None,
    )


def _trend(found: Registration) -> list[AlignedInterval]:
    table, own = found.sensors, found.trend
    return [
        AlignedInterval(
            time_s=float(time_s),
            sensor_id=table.ids[table.parameter_sensor[column]],
            parameter=PARAMETER_NAMES[table.parameter_kind[column]],
            estimate=float(own.estimate[row, column] * unit_of(table, column)),
            sigma=float(own.sigma[row, column] * unit_of(table, column)),
        )
        for column in range(len(table.parameter_sensor))
        for row, time_s in enumerate(own.time_s)
        if np.isfinite(own.estimate[row, column])
    ]


def _warnings(found: Registration, radars: Sequence[AlignedRadar]) -> list[str]:
    lines = [*found.tracked.warnings]
    for one in radars:
        count = one.residuals.aircraft
        if not count:
            lines.append(
                f"{one.sensor_id}: no aircraft in common with another sensor within "
                f"{APART_MAX_S:g} s; its biases remain at their priors"
            )
        elif count < AIRCRAFT_FEW:
            lines.append(
                f"{one.sensor_id}: {count} aircraft in common with other sensors; the sigma of its "
                "biases is therefore uncertain"
            )
    if len(np.unique(found.validation.fold)) < AIRCRAFT_MIN:
        lines.append(
            "only one aircraft was found and none could be withheld, so the residuals after "
            "correction are not validated"
        )
    if found.track_fraction < 1.0:
        lines.append(
            f"the recording is long; only {found.track_fraction:.1%} of its tracks were used"
        )
    return lines
