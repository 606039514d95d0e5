"""Wrong sites, range scales and clocks, by one fit of all radars that share aircraft.

Differences between positions of one aircraft by two sensors are fitted with offsets of range,
azimuth and time of every radar and a scale of pressure heights, and then with one error of a radar
in addition, or a displacement of the positions that a sensor reports; a clock error is the offset
in time of one radar alone. An error shows in every pair with this sensor and in no other: a sensor
that reports positions, or the shape of the network, determines which one is wrong.

Errors of all plots of an aircraft are common. The covariance is therefore that of clusters by
aircraft (Liang and Zeger, *Longitudinal data analysis using generalized linear models*,
Biometrika 73, 1986).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.comparison import Comparison, configured_bias
from multiradar.diagnosis.cross_sensor.displacements import OPPOSITE, displacement, place
from multiradar.diagnosis.cross_sensor.effects import (
    CLOCK,
    GAIN,
    HEIGHTS_ALIKE_M,
    SCALE,
    SHIFT,
    Effects,
    SiteError,
    effects_at,
)
from multiradar.diagnosis.cross_sensor.radar_groups import sites_of
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named, joined
from multiradar.diagnosis.cross_sensor.registration import TIME_MIN_S
from multiradar.diagnosis.cross_sensor.trimmed_fit import Equations, TrimmedFit, with_usual_offsets
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import Floats, Integers, located
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_RANGE_GAIN,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

#: Minimum error that is reported: shift of a site, m, range and azimuth in proportion, time, s.
#: Azimuth errors that vary with the sine of the azimuth, of up to 0.3°, resemble one of 0.16 %.
LEAST = {SHIFT: 150.0, GAIN: 0.0018, SCALE: 0.0025, CLOCK: 0.2}
#: ... and of positions that a sensor reports, m, which two radars with offsets of their own show.
POSITIONS_LEAST_M = 75.0
#: An error is significant from this multiple of its standard deviation on.
SIGMAS = 8.0
#: Aircraft and pairs that an error needs; pairs in a fit, at most.
AIRCRAFT_MIN, PAIRS_MIN, PAIRS_MAX = 12, 60, 6_000
#: ... and a displacement of so many standard deviations that leaves this fraction of the residuals:
#: helicopters are few.
FEW_AIRCRAFT_MIN, FEW_SIGMAS, FEW_LEFT_MAX = 5, 40.0, 0.5
#: An error whose improvement of the fit is within this fraction of the best is as likely.
ALIKE = 0.05
#: Radars are mostly adjusted to 250 m and 0.25°: an error is seven times less likely if the offsets
#: beside it have a sum of squares that is larger by this, in units of 500 m and 0.5° (`_OFFSETS`).
OFFSETS_MORE = 1.0
#: Number of errors found in one run, at most.
ERRORS_MAX = 3
#: Larger differences of two positions are those of other aircraft, m.
APART_MAX_M = 20_000.0
_REMEDIES = {
    SHIFT: "latitude_deg and longitude_deg in the sensors file",
    GAIN: "the ranges, or set bias.range_gain in the sensors file",
    SCALE: "the unit of the azimuths (counts per revolution?)",
    CLOCK: "its times, or set bias.time_offset_s in the sensors file",
}
_SCALED = {GAIN: ("ranges", "long", "short"), SCALE: ("azimuths", "large", "small")}
_CODES = {SHIFT: "site", GAIN: "range_gain", SCALE: "azimuth_scale"}
# Sizes of the columns of a fit: range m, azimuth rad and time s of a radar; each kind of error.
_OFFSETS = (500.0, float(np.radians(0.5)), 1.0)
_STEPS = {SHIFT: 1000.0, GAIN: 0.01, SCALE: 0.01, CLOCK: _OFFSETS[2]}


class _Rows(NamedTuple):
    """Pairs of all radars: both sensors, differences east and north, heights of the aircraft."""

    own: Integers
    apart: Floats
    height_m: Floats
    rotation: Floats
    pairs: Pairs


class JointFit:
    """One fit of radars that share aircraft.

    Parameters
    ----------
    sensors : SensorTable
        As configured.
    comparison : Comparison
        The plots.
    compared : mapping of (Agreement, Pairs)
        Radars, and the positions of their aircraft by other sensors.
    """

    def __init__(
        self,
        sensors: SensorTable,
        comparison: Comparison,
        compared: Mapping[int, tuple[Agreement, Pairs]],
    ) -> None:
        self._sensors, self._comparison = sensors, comparison
        self._rows = _rows(comparison, compared)
        self._basis = np.zeros((0, 2, 0))
        if self._rows is not None:
            columns = [_offset_columns(comparison, self._rows)]
            columns += _eccentricity_columns(sensors, comparison, self._rows)
            self._basis = np.concatenate(columns, axis=2)

    @property
    def radars(self) -> list[int]:
        """The radars of the fit, as rows of the table of sensors."""
        return [] if self._rows is None else _radars_of(self._comparison, self._rows)

    def site_errors(self) -> list[tuple[SiteError, ...]]:
        """Return errors of sites and range scales, the most certain first.

        Returns
        -------
        list of tuple of SiteError
            An error, or several of which the plots do not show which one it is, most likely
            first.
        """
        if self._rows is None:
            return []
        radars = np.unique(self._rows.own).tolist()
        with_gain = [one for one in radars if self._is_given(one, PARAMETER_RANGE_GAIN)]
        candidates = [(SHIFT, one) for one in sites_of(self._comparison, radars)]
        candidates += [(SHIFT, (one,)) for one in self._reporting()]
        candidates += [(GAIN, (one,)) for one in radars if one not in with_gain]
        candidates += [(SCALE, (one,)) for one in radars]
        return self._search(self._rows, candidates, {})

    def clock_errors(self) -> list[tuple[SiteError, ...]]:
        """Return errors of clocks that are not estimated, in the form of `site_errors`."""
        if self._rows is None:
            return []
        timed = {
            radar: 3 * number + 2
            for number, radar in enumerate(_radars_of(self._comparison, self._rows))
            if configured_bias(self._sensors, radar, PARAMETER_TIME_OFFSET)[1] == 0.0
        }
        offsets = Equations(self._rows.apart, self._basis).fit(range(self._basis.shape[2])).solution
        times = np.array([0.0, *(offsets[column] for column in timed.values())])
        if np.ptp(times) < 0.5 * LEAST[CLOCK] / _STEPS[CLOCK]:
            # Most recordings need this fit only.
            return []
        return self._search(self._rows, [(CLOCK, (one,)) for one in timed], timed)

    # Sensors that report positions.
    def _reporting(self) -> list[int]:
        sources = [] if self._rows is None else np.unique(self._rows.pairs.source).tolist()
        return [
            one
            for one in sources
            if one >= 0
            and not self._comparison.is_radar(one)
            and not self._is_given(one, PARAMETER_FRAME_EAST)
        ]

    def _is_given(self, number: int, kind: int) -> bool:
        return configured_bias(self._sensors, number, kind) != (0.0, 0.0)

    # Clocks are columns of the basis, which are not among the offsets of all fits then.
    def _search(
        self,
        rows: _Rows,
        candidates: Sequence[tuple[str, tuple[int, ...]]],
        of_basis: Mapping[int, int],
    ) -> list[tuple[SiteError, ...]]:
        size = self._basis.shape[2]
        columns = [
            _error_columns(self._comparison, rows, kind, radars)
            for kind, radars in candidates
            if kind != CLOCK
        ]
        all_columns = np.concatenate([self._basis, *columns], axis=2)
        equations = Equations(rows.apart, all_columns, self._comparison.proceed)
        own = [[of_basis[radars[0]]] for kind, radars in candidates if kind == CLOCK]
        ends = size + np.cumsum([one.shape[2] for one in columns])
        own += [
            list(range(end - one.shape[2], end)) for one, end in zip(columns, ends, strict=True)
        ]
        known = [one for one in range(size) if [one] not in own]
        remaining = list(range(len(candidates)))
        found: list[tuple[SiteError, ...]] = []
        for _ in range(ERRORS_MAX):
            plain = equations.fit(known)
            fits = {one: equations.fit([*known, *own[one]]) for one in remaining}
            errors = {
                one: error
                for one, fit in fits.items()
                if (error := _error(rows, candidates[one], plain, fit, equations)) is not None
            }
            if not errors:
                break
            scale = min(fits[one].scale for one in errors)
            gains = {one: _cost(plain, scale) - _cost(fits[one], scale) for one in errors}
            ranked = sorted(errors, key=lambda one: -gains[one])
            if not gains[ranked[0]] > 0.0:
                # None explains the residuals better than no error does.
                break
            alike = [one for one in ranked if gains[one] >= (1.0 - ALIKE) * gains[ranked[0]]]
            # A radar and the positions that it is compared with alone: the radar is wrong.
            sited = [one for one in alike if candidates[one][1][0] not in self._reporting()]
            likely = sited or alike
            if len(likely) > 1 and not of_basis:
                count = len(_radars_of(self._comparison, rows))
                likely = with_usual_offsets({one: fits[one] for one in likely}, count, OFFSETS_MORE)
            found.append(tuple(errors[one] for one in likely))
            known += own[likely[0]]
            wrong = set(errors[likely[0]].radars).union(
                *(candidates[one][1] for one in alike if one not in likely)
            )
            remaining = [one for one in remaining if not wrong & set(candidates[one][1])]
        return found


# The sum of a robust loss of all residuals.
def _cost(fit: TrimmedFit, scale: float) -> float:
    return float(np.log1p((fit.residual_m / scale) ** 2).sum())


def check_site_errors(
    sensors: SensorTable, joint: Sequence[JointFit]
) -> tuple[set[int], list[Diagnosis]]:
    """Diagnose wrong sites and range scales.

    Parameters
    ----------
    sensors : SensorTable
        As configured.
    joint : sequence of JointFit
        Of the radars, by group.

    Returns
    -------
    radars : set of int
        Those that are, or may be, wrong.
    found : list of Diagnosis
        One sentence for each error.
    """
    radars: set[int] = set()
    found = []
    for group, likely in ((fit, one) for fit in joint for one in fit.site_errors()):
        radars.update(one for error in likely for one in error.radars)
        names = [sensors.ids[one] for one in group.radars]
        sentence = _sentence(sensors, likely[0], likely[1:], names)
        code = _CODES[likely[0].kind]
        code = code if _is_sited(sensors, likely[0]) else "positions_displaced"
        found.append(Diagnosis(sensors.ids[likely[0].radars[0]], code, sentence))
    return radars, found


def check_clock_errors(sensors: SensorTable, joint: Sequence[JointFit]) -> list[Diagnosis]:
    """Diagnose clocks; off by less than `TIME_MIN_S` with a warning: they hardly affect biases."""
    return [
        Diagnosis(
            sensors.ids[likely[0].radars[0]],
            "clock",
            _sentence(sensors, likely[0], likely[1:]),
            "error" if abs(likely[0].value[0]) >= TIME_MIN_S else "warning",
        )
        for fit in joint
        for likely in fit.clock_errors()
    ]


def _sentence(
    sensors: SensorTable, error: SiteError, others: Sequence[SiteError], radars: Sequence[str] = ()
) -> str:
    what = [_description(sensors, one) for one in (error, *others)]
    alone = "" if len(what) == 1 else " (data of another radar or ADS-B would show which)"
    kinds = {one.kind for one in (error, *others)}
    remedies = [_REMEDIES[kind] for kind in _REMEDIES if kind in kinds]
    if not _is_sited(sensors, error):
        remedies = ["its positions, or remove it from the recording"]
        if len(radars) > 1:
            what[0] += f", or the sites of all radars ({listed(radars)}) by {OPPOSITE}"
            remedies = ["its positions, or the sites in the sensors file"]
    return (
        f"{', or '.join(what)}{alone}: with the {'first ' if others else ''}error corrected, the "
        f"median distance of its plots from the positions measured by other sensors is "
        f"{error.after_m:.0f} m ({error.before_m:.0f} m as recorded); "
        f"correct {' or '.join(remedies)}"
    )


def _description(sensors: SensorTable, error: SiteError) -> str:
    names = listed([sensors.ids[one] for one in error.radars])
    whose = "its" if len(error.radars) == 1 else "their"
    if error.kind == CLOCK:
        sense = "ahead" if error.value[0] > 0.0 else "behind"
        return f"{names}: {whose} clock is probably {abs(error.value[0]):.2f} s {sense}"
    if error.kind in (GAIN, SCALE):
        what, *senses = _SCALED[error.kind]
        sense = senses[error.value[0] < 0.0]
        return f"{names}: {whose} {what} are probably {abs(error.value[0]):.1%} too {sense}"
    # Configured minus true site, but reported minus true position.
    sign = -1.0 if _is_sited(sensors, error) else 1.0
    east_m, north_m = sign * error.value[0], sign * error.value[1]
    where = displacement(float(np.hypot(east_m, north_m)), float(np.arctan2(east_m, north_m)))
    if not _is_sited(sensors, error):
        return f"{names}: {whose} positions are probably displaced by {where} (another datum?)"
    number = error.radars[0]
    latitude_rad, longitude_rad = sensors.latitude_rad[number], sensors.longitude_rad[number]
    site_m = geodetic_to_ecef(latitude_rad, longitude_rad, sensors.height_m[number])
    site_m = site_m + np.array([east_m, north_m, 0.0]) @ enu_rotation(latitude_rad, longitude_rad)
    latitude, longitude, _ = ecef_to_geodetic(site_m)
    return (
        f"{names}: {whose} site is probably {where} of the configured site, at "
        f"{place(float(latitude), float(longitude))}"
    )


# Whether an error is of a radar; else of a sensor that reports positions.
def _is_sited(sensors: SensorTable, error: SiteError) -> bool:
    return bool(sensors.kinds[error.radars[0]] == KIND_RADAR)


# The error of a fit, None where it is not significant or too small.
def _error(
    rows: _Rows,
    candidate: tuple[str, tuple[int, ...]],
    plain: TrimmedFit,
    fit: TrimmedFit,
    equations: Equations,
) -> SiteError | None:
    kind, radars = candidate
    about = np.isin(rows.own, radars) != np.isin(rows.pairs.source, radars)
    used = about & fit.used
    aircraft = _aircraft(rows, used)
    few = aircraft < AIRCRAFT_MIN
    if np.count_nonzero(used) < PAIRS_MIN or aircraft < FEW_AIRCRAFT_MIN:
        return None
    count = 2 if kind == SHIFT else 1
    solution = fit.solution[-count:]
    value = solution * _STEPS[kind]
    is_reported = kind == SHIFT and not np.isin(radars, rows.own).any()
    if float(np.linalg.norm(value)) < (POSITIONS_LEAST_M if is_reported else LEAST[kind]):
        return None
    covariance = equations.clustered(fit, count, rows.pairs.name)
    sigmas = float(np.sqrt(solution @ np.linalg.solve(covariance, solution)))
    before, after = (float(np.median(one.residual_m[about])) for one in (plain, fit))
    if sigmas < (FEW_SIGMAS if few else SIGMAS):
        return None
    if few and (kind != SHIFT or is_reported or after > FEW_LEFT_MAX * before):
        return None
    return SiteError(kind, radars, tuple(value.tolist()), before, after)


# Aircraft of some rows. Names below 0 are paths, of which each sensor has its own of an aircraft.
def _aircraft(rows: _Rows, used: NDArray[np.bool_]) -> int:
    columns = np.column_stack([rows.own, rows.pairs.source, rows.pairs.name])[used]
    paths = np.unique(columns[columns[:, 2] < 0], axis=0)
    _, of_pair = np.unique(paths[:, :2], axis=0, return_counts=True)
    return int(max(len(np.unique(columns[columns[:, 2] >= 0, 2])), of_pair.max(initial=0)))


def _rows(comparison: Comparison, compared: Mapping[int, tuple[Agreement, Pairs]]) -> _Rows | None:
    parts = [_rows_of(comparison, number, *one) for number, one in compared.items()]
    count = sum(len(one.own) for one in parts)
    if count < PAIRS_MIN:
        return None
    chosen = np.unique(np.linspace(0, count - 1, min(count, PAIRS_MAX)).astype(np.intp))
    own, apart, height_m, rotation = (
        np.concatenate(column)[chosen] for column in list(zip(*parts, strict=True))[:4]
    )
    pairs = joined(*(one.pairs for one in parts)).select(chosen)
    return _Rows(own, apart, height_m, rotation, pairs)


def _rows_of(comparison: Comparison, number: int, agreement: Agreement, pairs: Pairs) -> _Rows:
    if not are_named(pairs):
        pairs = replace(pairs.select(agreement.matched), name=-2 - pairs.name[agreement.matched])
    pairs = pairs.select(np.flatnonzero(np.isfinite(pairs.velocity_mps).all(axis=1)))
    plots, site = comparison.tested(number).select(pairs.plot), comparison.site(number)
    latitude, longitude, seen_m = ecef_to_geodetic(pairs.position_m)
    height_m = np.where(np.isfinite(plots.height_m), plots.height_m, seen_m)
    rotation = enu_rotation(latitude, longitude)
    where = located(site, plots.range_m, np.radians(plots.azimuth_deg), height_m)
    apart = np.einsum("kij,kj->ki", rotation, where - pairs.position_m)[:, :2]
    good = np.flatnonzero(
        comparison.have_heights(number, pairs)
        & (np.linalg.norm(apart, axis=1) <= APART_MAX_M)
        & (np.abs(height_m - seen_m) <= HEIGHTS_ALIKE_M)
    )
    own = np.full(len(good), number)
    return _Rows(own, apart[good], height_m[good], rotation[good], pairs.select(good))


# Offsets of all radars, and the scale of heights: (k, 2, 3 radars + 1).
def _offset_columns(comparison: Comparison, rows: _Rows) -> Floats:
    flown = -np.einsum("kij,kj->ki", rows.rotation, rows.pairs.velocity_mps)[:, :2, None]
    radars = _radars_of(comparison, rows)
    found = np.zeros((len(rows.own), 2, 3 * len(radars) + 1))
    for column, radar in enumerate(radars):
        some, sign, seen = _seen(comparison, rows, radar)
        of_it = np.concatenate([seen.offsets, flown[some]], axis=2) * _OFFSETS
        found[some, :, 3 * column : 3 * column + 3] = of_it * sign
        found[some, :, -1:] += seen.height_scale * sign
    return found


# Azimuth errors with the sine and cosine of the azimuth, where they are estimated: (k, 2, 1) each.
# Over a part of the circle, they resemble another site.
def _eccentricity_columns(
    sensors: SensorTable, comparison: Comparison, rows: _Rows
) -> list[Floats]:
    columns = []
    for radar in _radars_of(comparison, rows):
        for axis, kind in enumerate((PARAMETER_AZIMUTH_SINE, PARAMETER_AZIMUTH_COSINE)):
            if configured_bias(sensors, radar, kind)[1] > 0.0:
                some, sign, seen = _seen(comparison, rows, radar)
                column = np.zeros((len(rows.own), 2, 1))
                of_it = seen.offsets[:, :, 1:] * seen.along[:, axis, None, None]
                column[some] = of_it * _OFFSETS[1] * sign
                columns.append(column)
    return columns


def _radars_of(comparison: Comparison, rows: _Rows) -> list[int]:
    names = np.unique(np.concatenate([rows.own, rows.pairs.source])).tolist()
    return [one for one in names if comparison.is_radar(one)]


# A shift of the site, (k, 2, 2), or a factor of the ranges or azimuths, (k, 2, 1).
def _error_columns(
    comparison: Comparison, rows: _Rows, kind: str, radars: tuple[int, ...]
) -> Floats:
    if kind == SHIFT:
        return np.eye(2) * _STEPS[kind] * _sign(rows, radars)
    found = np.zeros((len(rows.own), 2, 1))
    some, sign, seen = _seen(comparison, rows, radars[0])
    value, direction = seen.range_m, seen.along
    if kind == SCALE:
        # The azimuth from 0 to 2π, of which it is a fraction; it moves a plot across.
        azimuth_rad = np.arctan2(seen.along[:, 0], seen.along[:, 1]) % (2.0 * np.pi)
        value, direction = seen.range_m * azimuth_rad, seen.across
    found[some] = (direction * (value * _STEPS[kind])[:, None])[:, :, None] * sign
    return found


# 1 for pairs with a plot of one of these radars, -1 with a position by one, 0 with none or both.
def _sign(rows: _Rows, radars: tuple[int, ...]) -> Floats:
    own, other = (np.isin(one, radars).astype(np.float64) for one in (rows.own, rows.pairs.source))
    return (own - other)[:, None, None]


# Pairs of a radar, their sign, and the effects of its errors on them.
def _seen(
    comparison: Comparison, rows: _Rows, radar: int
) -> tuple[NDArray[np.intp], Floats, Effects]:
    sign = _sign(rows, (radar,))
    some = np.flatnonzero(sign)
    where = comparison.site(radar), rows.pairs.position_m[some], rows.height_m[some]
    return some, sign[some], effects_at(*where)
