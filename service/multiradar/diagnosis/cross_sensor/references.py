"""Positions by other sensors of the aircraft of a sensor's plots.

Where plots identify their aircraft, plots of others with the same identity are interpolated to the
time of each plot; otherwise all tracks of others at that time are candidates.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from multiradar.diagnosis.plots import KEYS, Floats, Integers, Plots, Rows, reported

#: Maximum gap over which plots of others are interpolated, s.
GAP_MAX_S = 30.0
#: Plots that imply a higher speed than this are not of one aircraft, m/s.
SPEED_MAX_MPS = 700.0
#: Paths of unnamed aircraft that are compared with a plot.
PATHS_MAX = 600
#: An identity column is used where this fraction of plots has a value that another sensor also has.
NAMED_MIN = 0.5

#: The source of pairs with the position that the recording itself gives a plot.
RECORDING = -1


@dataclass(frozen=True, slots=True)
class Paths(Rows):
    """Plots of other sensors, each path a run of rows of one source and one aircraft by time.

    Attributes
    ----------
    path : (n,) int64
        Number of the path.
    name : (n,) int64
        The aircraft, by its identity or track.
    source : (n,) int64
        The sensor.
    time_s : (n,) float64
        Times.
    position_m : (n, 3) float64
        ECEF, m.
    """

    path: Integers
    name: Integers
    source: Integers
    time_s: Floats
    position_m: Floats


@dataclass(frozen=True, slots=True)
class Pairs(Rows):
    """Positions of aircraft that may be those of plots.

    Attributes
    ----------
    plot : (k,) int64
        Row of the plot.
    source : (k,) int64
        The sensor; `RECORDING` for the recording.
    name : (k,) int64
        The aircraft, by its identity or its path; −1 for the recording.
    position_m, velocity_mps : (k, 3) float64
        ECEF; the velocity is NaN where it is not known.
    """

    plot: Integers
    source: Integers
    name: Integers
    position_m: Floats
    velocity_mps: Floats


_NOTHING = np.empty(0, np.int64)
NO_PAIRS = Pairs(_NOTHING, _NOTHING, _NOTHING, np.empty((0, 3)), np.empty((0, 3)))


def common_key(plots: Plots, others: Iterable[Plots]) -> int | None:
    """Return which of `KEYS` names most of the plots and plots of others, None without such."""
    if plots.size == 0:
        return None
    for key in range(len(KEYS)):
        names = plots.keys[:, key]
        known = [one.keys[:, key] for one in others]
        shared = np.isin(names, np.concatenate(known)) if known else np.zeros(len(names), np.bool_)
        if np.count_nonzero(shared & (names >= 0)) >= NAMED_MIN * len(names):
            return key
    return None


def keys_by_sensor(plots: Plots, others: Mapping[int, Plots]) -> dict[int, int] | None:
    """Return which of `KEYS` names the aircraft that a sensor shares with each other, if any does.

    Parameters
    ----------
    plots : Plots
        Plots of the sensor.
    others : mapping of Plots
        Those of other sensors.

    Returns
    -------
    dict or None
        The key that names most of the plots, for sensors that have it, and for others the first one
        that they share: a secondary radar shares addresses with some, and codes with others.
    """
    key = common_key(plots, others.values())
    if key is None:
        return None
    found = {}
    for number, other in others.items():
        own = None if (other.keys[:, key] >= 0).any() else common_key(plots, [other])
        found[number] = key if own is None else own
    return found


def named_paths(source: int, plots: Plots, position_m: Floats, key: int) -> Paths:
    """Return the paths of the named aircraft of a source.

    Parameters
    ----------
    source : int
        The source.
    plots : Plots
        Its plots.
    position_m : (n, 3) float64
        Their positions, ECEF, m.
    key : int
        Which of `KEYS` names them.
    """
    return tracked_paths(np.full(plots.size, source), plots.keys[:, key], plots.time_s, position_m)


def tracked_paths(source: Integers, track: Integers, time_s: Floats, position_m: Floats) -> Paths:
    """Return the paths of unnamed aircraft, by the tracks that the tracker made."""
    rows = np.flatnonzero((track >= 0) & np.isfinite(position_m).all(axis=1))
    rows = rows[np.lexsort((time_s[rows], track[rows], source[rows]))]
    path = _runs(source[rows], track[rows])
    return Paths(path, track[rows], source[rows], time_s[rows], position_m[rows])


# The number of the run of equal values that each row belongs to.
def _runs(*columns: Integers) -> Integers:
    new = np.zeros(len(columns[0]), np.bool_)
    for one in columns:
        new[1:] |= one[1:] != one[:-1]
    return np.cumsum(new)


def named_pairs(plots: Plots, others: Iterable[tuple[int, Paths]], late_s: float) -> Pairs:
    """Return the positions by others of the aircraft of each plot.

    Parameters
    ----------
    plots : Plots
        Plots of one sensor.
    others : iterable of (int, Paths)
        Of each other sensor, and which of `KEYS` names its aircraft.
    late_s : float
        Time offset of the sensor: claimed time minus true time, s.
    """
    time_s = plots.time_s - late_s
    return joined(*(_interpolated(plots.keys[:, key], time_s, one) for key, one in others))


def candidate_pairs(
    plots: Plots, paths: Paths, late_s: float, names: Integers | None = None
) -> Pairs:
    """Return for each plot the positions by others of all aircraft at its time.

    Parameters
    ----------
    plots : Plots
        Plots of one sensor.
    paths : Paths
        Those of others; of many, the longest are compared.
    late_s : float
        Time offset of the sensor: claimed time minus true time, s.
    names : (n,) int64, optional
        An aircraft for each plot: only its position, for paths of one sensor.

    Returns
    -------
    Pairs
        By ascending plot; `name` is the path.
    """
    if paths.size == 0:
        return NO_PAIRS
    lengths = np.bincount(paths.path)
    longest = np.argsort(-lengths, kind="stable")[:PATHS_MAX]
    longest = longest[lengths[longest] > 1]
    chosen = paths.select(np.isin(paths.path, longest))
    if names is None:
        plot = np.repeat(np.arange(plots.size), len(longest))
        wanted = np.tile(longest, plots.size)
    else:
        one = chosen.select(np.flatnonzero(np.diff(chosen.path, prepend=-1)))
        path_of_name = dict(zip(one.name.tolist(), one.path.tolist(), strict=True))
        wanted = np.array([path_of_name.get(name, -1) for name in names.tolist()], np.int64)
        plot = np.arange(plots.size)
    return _interpolated(
        wanted, plots.time_s[plot] - late_s, replace(chosen, name=chosen.path), plot
    )


def recorded_pairs(plots: Plots) -> Pairs:
    """Return for each plot its position in the recording, where there is one."""
    position = reported(plots)
    known = np.flatnonzero(np.isfinite(position).all(axis=1))
    nothing = np.full((len(known), 3), np.nan)
    recording = np.full(len(known), RECORDING)
    return Pairs(known, recording, np.full(len(known), -1), position[known], nothing)


def are_named(pairs: Pairs) -> bool:
    """Return whether each plot has one position by each other sensor, that of its aircraft."""
    of_others = pairs.select(pairs.source >= 0)
    return len(np.unique(np.column_stack([of_others.plot, of_others.source]), axis=0)) == (
        of_others.size
    )


def joined(*parts: Pairs) -> Pairs:
    """Return the pairs of all parts."""
    if not parts:
        return NO_PAIRS
    names = [one.name for one in fields(Pairs)]
    return Pairs(**{name: np.concatenate([getattr(one, name) for one in parts]) for name in names})


# Paths must be by name and time. Times and names together become one number to search.
def _interpolated(
    names: Integers, time_s: Floats, paths: Paths, plot: Integers | None = None
) -> Pairs:
    known = paths.time_s
    if len(known) < 2:
        return NO_PAIRS
    origin = float(known.min())
    span = float(known.max()) - origin + 4.0 * GAP_MAX_S
    code = _runs(paths.name)
    all_names = paths.name[np.flatnonzero(np.diff(code, prepend=-1))]
    index = np.minimum(np.searchsorted(all_names, names), len(all_names) - 1)
    inside = (time_s >= origin) & (time_s <= origin + span - 3.0 * GAP_MAX_S)
    found = (all_names[index] == names) & inside
    wanted = index * span + np.where(inside, time_s - origin, 0.0)
    after = np.searchsorted(code * span + (known - origin), wanted)
    found &= (after > 0) & (after < len(known))
    last = np.clip(after, 1, len(known) - 1)
    first = last - 1
    found &= (code[first] == index) & (code[last] == index)
    gap = paths.time_s[last] - paths.time_s[first]
    found &= (gap > 0.0) & (gap <= GAP_MAX_S)
    chosen = np.flatnonzero(found)
    first, last, gap = first[chosen], last[chosen], gap[chosen]
    velocity = (paths.position_m[last] - paths.position_m[first]) / gap[:, None]
    position = paths.position_m[first] + velocity * (time_s[chosen] - paths.time_s[first])[:, None]
    credible = np.linalg.norm(velocity, axis=1) <= SPEED_MAX_MPS
    plots = chosen if plot is None else plot[chosen]
    return Pairs(plots, paths.source[first], paths.name[first], position, velocity).select(credible)
