"""Azimuths in another form, by the direction of the antenna at the time of each plot.

Clutter and interference may come at any time, so that the coherence of all plots is low. Of those
of aircraft, though, nearly all lie in the beam of the antenna, and few do in another form.
"""

from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.cross_sensor.hypotheses import AZIMUTH_UNITS, HALVED_AZIMUTHS
from multiradar.diagnosis.cross_sensor.plausibility import CLOSER
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Booleans, Floats, Plots
from multiradar.diagnosis.scans import (
    PERIOD_MAX_S,
    PERIOD_MIN_S,
    WINDOW_S,
    coherences,
    windows_of,
)

Windows = list[tuple[Floats, Floats]]

#: Half widths of the directions that count as the beam, rad, from the first to the last estimate.
_WIDTHS_RAD = (0.6, 0.3, 0.15, 0.1)
#: Fraction of the plots in the beam with the right form, at least, and over that in another form:
#: of plots at any time 3 % are in it.
_SHARE_MIN, _RATIO_MIN = 0.5, 2.0
#: ... or so many, and the fraction outside is less than in another form by the factor `CLOSER`.
_SURELY = 0.95
#: Plots that show it, and identified ones, as a fraction, that are used alone.
_PLOTS_MIN, _IDENTIFIED_MIN = 100, 0.2
#: Tolerance of a scan period.
_PERIOD_WITHIN = 0.03
#: Fraction of folded azimuths on the first side, at least; number of the others, and fraction of
#: them that is in one beam, too.
_SIDE_MIN, _SIDE_PLOTS_MIN, _REST_MIN = 0.2, 20, 0.6
#: Steps of frequency in the width of a peak.
_STEPS = 6.0
#: Folded azimuths and azimuths in half a circle end here, degrees.
_HALF_CIRCLE_DEG = 180.5
#: Least number of different minutes and degrees; the largest minute and the end of minutes, as a
#: decimal part.
_MINUTES_MIN, _MINUTES_MAX, _MINUTES_END = 30, 0.55, 0.6


class Beam(NamedTuple):
    """A rotation, and which plots are in the beam of the antenna.

    Attributes
    ----------
    period_s : float
        Scan period, s; negative when azimuths are counted anticlockwise.
    share : float
        Fraction of the plots in the beam.
    """

    period_s: float
    share: float


_NONE = Beam(np.nan, 0.0)


def check_azimuth_form(name: str, plots: Plots, period_s: float) -> Diagnosis | None:
    """Diagnose azimuths in another form, of which the antenna direction shows the right one.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    period_s : float
        The configured scan period, s; NaN where unknown.
    """
    plots = plots.select(np.isfinite(plots.azimuth_deg))
    identified = plots.keys.max(axis=1) >= 0
    if np.mean(identified) >= _IDENTIFIED_MIN and identified.sum() >= _PLOTS_MIN:
        plots = plots.select(identified)
    if plots.size < _PLOTS_MIN:
        return None
    time_s, azimuth = plots.time_s, plots.azimuth_deg
    clockwise, anticlockwise = (beam(time_s, np.radians(azimuth), one) for one in (1.0, -1.0))
    given = max(clockwise.share, anticlockwise.share)
    folded = _of_minutes(name, azimuth) or _of_half_circle(name, time_s, azimuth, period_s)
    if folded is not None or clockwise.share >= _SURELY:
        return folded
    if _is_beam(anticlockwise, clockwise.share, period_s):
        return Diagnosis(
            name,
            "azimuth_anticlockwise",
            f"{name}: its azimuths are probably measured anticlockwise: they decrease from plot "
            f"to plot, by one revolution in {-anticlockwise.period_s:.2f} s, in "
            f"{anticlockwise.share:.0%} of the plots of aircraft; measure them clockwise from true "
            "north (if they are angles from east, as in mathematics: 90° minus each value)",
        )
    return _of_units(name, time_s, azimuth, given, period_s)


# Degrees and minutes as one number.
def _of_minutes(name: str, azimuth: Floats) -> Diagnosis | None:
    parts = np.unique(np.round(azimuth % 1.0, 6))
    if len(parts) < _MINUTES_MIN or len(np.unique(np.floor(azimuth))) < _MINUTES_MIN:
        return None
    if not _MINUTES_MAX <= parts[-1] <= _MINUTES_END:
        return None
    return Diagnosis(
        name,
        "azimuth_minutes",
        f"{name}: its azimuths are probably in degrees and minutes (46.30 for 46° 30'): no decimal "
        f"part exceeds {parts[-1]:.2f}; convert them to decimal degrees",
    )


def beam(time_s: Floats, azimuth_rad: Floats, sense: float, about_s: float = np.nan) -> Beam:
    """Return the rotation with most plots in the beam.

    Parameters
    ----------
    time_s, azimuth_rad : (n,) float64
        Plots of a radar by time.
    sense : float
        1: clockwise, −1: anticlockwise.
    about_s : float
        The scan period, if it is known: it is only refined.
    """
    windows = windows_of(time_s, azimuth_rad)
    return _fitted(windows, sense, about_s) if windows else _NONE


def _fitted(windows: Windows, sense: float, about_s: float = np.nan) -> Beam:
    step = 1.0 / (_STEPS * WINDOW_S)
    low, high = 1.0 / PERIOD_MAX_S, 1.0 / PERIOD_MIN_S
    if np.isfinite(about_s):
        low, high = (1.0 - _PERIOD_WITHIN) / about_s, (1.0 + _PERIOD_WITHIN) / about_s
    frequencies = sense * np.linspace(low, high, max(int((high - low) / step), 1) + 1)
    best = float(frequencies[coherences(windows, frequencies).argmax()])
    for width in _WIDTHS_RAD:
        near = [
            (times[inside], azimuths[inside])
            for times, azimuths in windows
            for inside in [_inside(times, azimuths, best, width)]
        ]
        finer = best + np.linspace(-step, step, 41)
        best = float(finer[coherences(near, finer).argmax()])
        step /= 2.0
    inside = sum(int(one.sum()) for one in _in_beam(windows, best))
    return Beam(1.0 / best, inside / sum(len(one) for one, _ in windows))


def _in_beam(windows: Windows, frequency: float) -> list[Booleans]:
    return [_inside(times, azimuths, frequency, _WIDTHS_RAD[-1]) for times, azimuths in windows]


def _inside(time_s: Floats, azimuth_rad: Floats, frequency: float, width: float) -> Booleans:
    return np.asarray(np.abs(_apart(time_s, azimuth_rad, frequency, width)) <= width)


# Angles to the most frequent direction of the antenna, rad.
def _apart(time_s: Floats, azimuth_rad: Floats, frequency: float, width: float) -> Floats:
    turned = azimuth_rad - 2.0 * np.pi * frequency * time_s
    phase = np.sort(turned % (2.0 * np.pi))
    whole = np.concatenate([phase, phase + 2.0 * np.pi])
    counts = np.searchsorted(whole, phase + 2.0 * width) - np.arange(len(phase))
    first = int(counts.argmax())
    return _wrapped(turned - np.median(whole[first : first + counts[first]]))


def _wrapped(angle_rad: Floats) -> Floats:
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)


def _is_beam(found: Beam, given: float, period_s: float) -> bool:
    near = np.isnan(period_s) or abs(abs(found.period_s) / period_s - 1.0) <= _PERIOD_WITHIN
    closer = found.share >= _SURELY and 1.0 - given > CLOSER * (1.0 - found.share)
    return bool(near and (closer or found.share >= max(_SHARE_MIN, _RATIO_MIN * given)))


def _of_units(
    name: str, time_s: Floats, azimuth: Floats, given: float, period_s: float
) -> Diagnosis | None:
    best, unit = _NONE, None
    for reading in (*AZIMUTH_UNITS, HALVED_AZIMUTHS):
        _, radians = reading.polar(azimuth, azimuth)
        if not 0.5 * np.pi <= float(np.max(radians)) <= 2.01 * np.pi:
            continue
        found = beam(time_s, radians, 1.0)
        if found.share > best.share and _is_beam(found, given, period_s):
            best, unit = found, reading
    if unit is None:
        return None
    return Diagnosis(
        name,
        unit.code,
        f"{name}: {unit.mistake}: their maximum is {azimuth.max():.2f}, and {best.share:.0%} of "
        f"the plots of aircraft advance with the antenna, by one revolution in "
        f"{best.period_s:.2f} s, with {unit.with_it} ({given:.0%} as recorded); {unit.remedy}",
    )


# Azimuths of both halves of the circle between 0 and 180°: outside the beam on the first side, the
# others are opposite to it, or turn the other way.
def _of_half_circle(
    name: str, time_s: Floats, azimuth: Floats, period_s: float
) -> Diagnosis | None:
    windows = windows_of(time_s, np.radians(azimuth))
    if not windows or azimuth.max() > _HALF_CIRCLE_DEG or azimuth.min() < 0.0:
        return None
    both = {sense: _fitted(windows, sense, period_s) for sense in (1.0, -1.0)}
    sense = max(both, key=lambda one: both[one].share)
    first = both[sense]
    apart = [_apart(*part, 1.0 / first.period_s, _WIDTHS_RAD[-1]) for part in windows]
    outside = [np.abs(angles) > _WIDTHS_RAD[-1] for angles in apart]
    count = sum(int(part.sum()) for part in outside)
    if first.share < _SIDE_MIN or count < _SIDE_PLOTS_MIN:
        return None
    opposite = sum(
        int((np.abs(_wrapped(angles + np.pi)) <= _WIDTHS_RAD[-1]).sum()) for angles in apart
    )
    if sense > 0.0 and opposite >= _REST_MIN * count:
        return _folded(name, azimuth, "reduced modulo 180°")
    others = [
        (times[out], azimuths[out])
        for (times, azimuths), out in zip(windows, outside, strict=True)
        if out.any()
    ]
    back, again = (_fitted(others, way, abs(first.period_s)) for way in (-sense, sense))
    if back.share < max(_REST_MIN, _RATIO_MIN * again.share):
        return None
    return _folded(name, azimuth, "angles from north on either side, without a sign")


def _folded(name: str, azimuth: Floats, how: str) -> Diagnosis:
    return Diagnosis(
        name,
        "azimuth_folded",
        f"{name}: its azimuths are probably {how}: their maximum is {azimuth.max():.1f}, and plots "
        "from both halves of each revolution are among them; write azimuths of 0 to 360°, "
        "clockwise from true north",
    )
