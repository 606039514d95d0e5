"""Figures of the aircraft-derived data of a sensor: how many reports have each value, its noise."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.checking import Integers, reason_counts
from multiradar_converters.aircraft_data.quantities import QUANTITIES, Numbers
from multiradar_converters.aircraft_data.variation import magnetic_variation

#: Residuals of a quantity that are retained, and least for a noise.
RESIDUALS_MAX = 20_000
RESIDUALS_MIN = 30
#: Values of which the least step is sought, and reports for the magnetic variation.
VALUES_MAX = 20_000
REPORTS_MAX = 20_000
#: Reports farther apart are not neighbours, s.
NEIGHBOURS_S = 45.0

_ANGLES = (q.MAGNETIC_HEADING, q.TRACK_ANGLE)
_SIGMA_OF_MEDIAN = 1.4826
_STEP_LEAST = 1e-6


@dataclass
class DataFigures:
    """Figures of one sensor, report by report.

    Noise is the deviation of a value from the line between the value before and the one after it of
    the same aircraft: it contains what is independent from report to report, and no offset. It is
    one sigma from the median, at least that of the rounding to the step of the values.

    Attributes
    ----------
    reports : int
        Reports.
    with_data : int
        Reports with any value.
    counts : int64[10]
        Reports with each value.
    dropped : Counter
        Reports with dropped values, by reason.
    """

    reports: int = 0
    with_data: int = 0
    counts: Integers = field(default_factory=lambda: np.zeros(q.COUNT, np.int64))
    dropped: Counter[str] = field(default_factory=Counter)
    _residuals: list[list[Numbers]] = field(default_factory=lambda: [[] for _ in QUANTITIES])
    _values: list[list[Numbers]] = field(default_factory=lambda: [[] for _ in QUANTITIES])
    _reports: list[Numbers] = field(default_factory=list)

    def add(
        self,
        values: Numbers,
        dropped: Integers,
        aircraft: Integers,
        time_s: Numbers,
        height_m: Numbers,
    ) -> None:
        """Add reports.

        Parameters
        ----------
        values : float64[n, 10] or float64[n, 0]
            Their values.
        dropped : int64[n]
            Reasons for which values were dropped, bits.
        aircraft : int64[n]
            Equal for reports of one aircraft; negative for unknown ones.
        time_s, height_m : float64[n]
            Times, s, and heights, m.
        """
        self.reports += len(values)
        self.dropped.update(reason_counts(dropped))
        if not values.shape[1]:
            return
        given = ~np.isnan(values)
        self.counts += given.sum(axis=0)
        self.with_data += int(given.any(axis=1).sum())
        known = np.flatnonzero(aircraft >= 0)
        order = known[np.lexsort((time_s[known], aircraft[known]))]
        for k in np.flatnonzero(given.any(axis=0)).tolist():
            rows = order[given[order, k]]
            if sum(map(len, self._residuals[k])) < RESIDUALS_MAX:
                found = _residuals(values[rows, k], aircraft[rows], time_s[rows], k in _ANGLES)
                self._residuals[k].append(found[:: len(found) // RESIDUALS_MAX + 1])
            if sum(map(len, self._values[k])) < VALUES_MAX:
                self._values[k].append(values[rows[:VALUES_MAX], k])
        if sum(map(len, self._reports)) < REPORTS_MAX:
            whole = np.flatnonzero(given[:, [q.MAGNETIC_HEADING, q.TRACK_ANGLE]].all(axis=1))
            some = whole[:: len(whole) // REPORTS_MAX + 1]
            self._reports.append(np.column_stack([values[some], height_m[some]]))

    def sigma(self, quantity: int) -> float | None:
        """Return the noise of a quantity in its unit; None with too few reports."""
        found = np.concatenate([np.empty(0), *self._residuals[quantity]])
        if len(found) < RESIDUALS_MIN:
            return None
        values = np.unique(np.concatenate(self._values[quantity]))
        steps = np.diff(values)
        steps = steps[steps > _STEP_LEAST]
        rounding = float(steps.min(initial=np.inf)) / np.sqrt(12.0) if len(steps) else 0.0
        return max(_SIGMA_OF_MEDIAN * float(np.median(found)), rounding)

    def document(self) -> dict[str, object]:
        """Return the figures for a report; empty without data."""
        if not self.with_data and not self.dropped:
            return {}
        reports = np.concatenate([np.empty((0, q.COUNT + 1)), *self._reports])
        variation = magnetic_variation(reports[:, : q.COUNT], reports[:, q.COUNT])
        return {
            "reports": self.reports,
            "with_data": self.with_data,
            "values": {
                name: {"reports": int(count), "sigma": _rounded(self.sigma(k))}
                for k, (name, count) in enumerate(zip(QUANTITIES, self.counts, strict=True))
                if count
            },
            "dropped": dict(sorted(self.dropped.items())),
            "magnetic_variation_deg": variation,
        }


def _rounded(sigma: float | None) -> float | None:
    return None if sigma is None else float(f"{sigma:.3g}")


def _residuals(values: Numbers, aircraft: Integers, time_s: Numbers, angle: bool) -> Numbers:
    """Return the deviations of values from the line between their neighbours, one sigma each."""
    before_s, after_s = time_s[1:-1] - time_s[:-2], time_s[2:] - time_s[1:-1]
    own = (aircraft[2:] == aircraft[:-2]) & (before_s > 0.0) & (after_s > 0.0)
    own &= before_s + after_s <= NEIGHBOURS_S
    weight = after_s[own] / (before_s + after_s)[own]
    before, after = values[:-2][own] - values[1:-1][own], values[2:][own] - values[1:-1][own]
    if angle:
        half = q.REVOLUTION_DEG / 2.0
        before, after = ((one + half) % q.REVOLUTION_DEG - half for one in (before, after))
    apart = weight * before + (1.0 - weight) * after
    deviation: Numbers = np.abs(apart) / np.sqrt(1.0 + weight**2 + (1.0 - weight) ** 2)
    return deviation
