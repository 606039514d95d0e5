"""The scorecard as plots: map, errors, air picture, consistency, biases."""

from collections.abc import Iterator

import numpy as np

from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.measures.consistency import Consistency
from multiradar.evaluation.scorecard import Scorecard
from multiradar.evaluation.trajectories import Flags, Floats, Indices, joined, positions_at
from multiradar.report.content import Plot, Series, Style
from multiradar.report.times import axis_label, time_text

#: Maximum number of points on a map, of the tracks and of the reference each.
_MAP_POINTS_MAX = 12_000
#: Bins of a plot over time, and of a histogram.
_BINS = 60
#: Minimum track age for the largest error; time shown before and after it, s.
_SETTLED_S, _AROUND_S = 60.0, 30.0
#: Maximum number of biases drawn.
_BIASES_MAX = 24
# By the suffix of the parameter.
_UNITS = {"m": "m", "deg": "°", "gain": "1", "s": "s"}


def card_plots(card: Scorecard) -> list[Plot]:
    """Return the plots of a scorecard.

    Parameters
    ----------
    card : Scorecard
        All measures.

    Returns
    -------
    list of Plot
        The map first; biases last.
    """
    # One label for all time axes, so that adjacent plots share their limits.
    instants_s = card.instants.time_s
    time_label = axis_label(instants_s[[0, -1]].tolist() if len(instants_s) else [])
    plots = [_map(card)]
    if len(card.errors.time_s):
        plots += [*_worst(card), _errors_over_time(card, time_label), *_distributions(card)]
    plots += _air_picture(card, time_label)
    for name, unit, found in (
        ("position", "Position", card.position),
        ("velocity", "Velocity", card.velocity),
    ):
        if found is not None:
            plots.append(_consistency(name, unit, found, time_label))
    plots += [bias_plot(one, time_label) for one in card.biases[:_BIASES_MAX]]
    return plots


def _map(card: Scorecard) -> Plot:
    reference, tracks, found = card.reference, card.tracks, card.track_classes
    series = [
        _lines("reference", reference.position_m, ~joined(reference), "reference"),
        *(
            _lines(label, tracks.position_m[rows], _ends(tracks.track[rows]), "line", key)
            for label, key, which in (
                ("tracks", "tracks", ~found.false_ & ~found.duplicate),
                ("duplicate tracks", "duplicate", found.duplicate),
                ("false tracks", "false", found.false_),
            )
            if (rows := np.flatnonzero(which[tracks.track])).size
        ),
    ]
    return Plot(
        title="Tracks and reference",
        x_label="east, km",
        y_label="north, km",
        series=tuple(series),
        equal_axes=True,
        caption="Coordinates relative to the centre of the reference.",
        name="map",
    )


# The neighbourhood of the largest error outside track initiation.
def _worst(card: Scorecard) -> Iterator[Plot]:
    errors, tracks, reference = card.errors, card.tracks, card.reference
    age_s = (
        errors.time_s - tracks.time_s[np.searchsorted(tracks.track, tracks.track)][errors.update]
    )
    established = np.flatnonzero(age_s >= _SETTLED_S)
    if not len(established):
        return
    row = int(established[np.argmax(errors.position_m[established])])
    time_s, aircraft = errors.time_s[row], errors.aircraft[row]
    near = np.abs(errors.time_s - time_s) <= _AROUND_S
    reported = tracks.position_m[errors.update[near & (errors.aircraft == aircraft)]] / 1000.0
    when = np.arange(time_s - _AROUND_S, time_s + _AROUND_S, 1.0)
    flown = positions_at(reference, np.full(len(when), aircraft), when).position_m / 1000.0
    worst = tracks.position_m[errors.update[row]] / 1000.0
    yield Plot(
        title=f"Largest error of an established track: {errors.position_m[row]:.0f} m, aircraft "
        f"{reference.names[aircraft]}, {time_text(time_s)}",
        x_label="east, km",
        y_label="north, km",
        series=(
            Series("reference", flown[:, 0], flown[:, 1], "reference"),
            Series("updates", reported[:, 0], reported[:, 1], "points", key="tracks"),
            Series("largest error", worst[:1], worst[1:], "rings", key="false"),
        ),
        equal_axes=True,
        caption=f"Track and reference within {_AROUND_S:g} s of the largest error.",
        name="worst",
    )


def _ends(owner: Indices) -> Flags:
    return np.append(np.diff(owner) != 0, np.ones(1, np.bool_))


# One series of many lines, separated by NaN.
def _lines(label: str, position_m: Floats, ends: Flags, style: Style, key: str = "") -> Series:
    every = -(-len(position_m) // _MAP_POINTS_MAX)
    # Decimation keeps both ends of every line.
    kept = (np.arange(len(position_m)) % every == 0) | ends | np.append(True, ends[:-1])
    position_km, ends = position_m[kept] / 1000.0, ends[kept]
    after = np.flatnonzero(ends) + 1
    east, north = (np.insert(position_km[:, axis], after, np.nan) for axis in (0, 1))
    return Series(label, east, north, style, key=key)


def _errors_over_time(card: Scorecard, time_label: str) -> Plot:
    errors = card.errors
    edges = np.linspace(errors.time_s.min(), errors.time_s.max(), _BINS + 1)
    number = np.clip(np.searchsorted(edges, errors.time_s, side="right") - 1, 0, _BINS - 1)
    middle = 0.5 * (edges[:-1] + edges[1:])
    figures = {name: np.full(_BINS, np.nan) for name in ("RMS", "median", "95 %")}
    for one in range(_BINS):
        own = errors.position_m[number == one]
        if len(own):
            figures["RMS"][one] = np.sqrt(np.mean(own**2))
            figures["median"][one], figures["95 %"][one] = np.percentile(own, [50.0, 95.0])
    return Plot(
        title="Position errors over time",
        x_label=time_label,
        x_scale="time",
        y_label="position error, m",
        series=(
            Series("updates", errors.time_s, errors.position_m, "points", key="updates"),
            *(Series(name, middle, values) for name, values in figures.items()),
        ),
        y_limits=(0.0, float(max(np.nanmax(figures["95 %"]) * 1.3, 1.0))),
        name="errors-over-time",
    )


def _distributions(card: Scorecard) -> Iterator[Plot]:
    errors = card.errors
    size = np.sort(errors.position_m)
    fraction = np.arange(1, len(size) + 1) / len(size) * 100.0
    group = "Position errors"
    yield Plot(
        title="Cumulative distribution of position errors",
        x_label="position error, m",
        y_label="updates, %",
        series=(Series("position", size, fraction),),
        x_limits=(0.0, float(max(np.percentile(size, 99.5), 1.0))),
        group=group,
        name="distribution",
    )
    bound = float(max(np.percentile(size, 99.0), 1.0))
    edges = np.linspace(-bound, bound, _BINS + 1)
    both = (("along", errors.along_m), ("across", errors.across_m))
    series = [
        Series(label, *_steps(edges, np.histogram(values[np.isfinite(values)], edges)[0]))
        for label, values in both
    ]
    yield Plot(
        title="Along-track and cross-track errors",
        x_label="error, m",
        y_label="updates",
        series=tuple(series),
        group=group,
        name="along-across",
    )


def _steps(edges: Floats, count: Indices) -> tuple[Floats, Floats]:
    return np.repeat(edges, 2)[1:-1], np.repeat(count, 2).astype(np.float64)


def _air_picture(card: Scorecard, time_label: str) -> Iterator[Plot]:
    instants, found = card.instants, card.distances
    count = len(instants.time_s)
    group = "Air picture over time"
    evaluated = instants.track_instant[instants.evaluated]
    tracked = instants.aircraft_instant[instants.track_of >= 0]
    yield Plot(
        title="Aircraft and tracks",
        x_label=time_label,
        x_scale="time",
        y_label="number",
        series=tuple(
            Series(label, instants.time_s, np.bincount(rows, minlength=count).astype(np.float64))
            for label, rows in (
                ("aircraft", instants.aircraft_instant),
                ("aircraft with a track", tracked),
                ("evaluated tracks", evaluated),
            )
        ),
        group=group,
        name="numbers",
    )
    yield Plot(
        title=f"OSPA (c = {card.settings.cutoff_m:g} m, p = {card.settings.order:g})",
        x_label=time_label,
        x_scale="time",
        y_label="OSPA, m",
        series=(Series("OSPA", instants.time_s, np.where(found.present, found.ospa_m, np.nan)),),
        group=group,
        name="ospa",
    )


def _consistency(name: str, title: str, found: Consistency, time_label: str) -> Plot:
    top = float(max(np.percentile(found.mean_by_time, 98.0), found.high.max())) * 1.2
    return Plot(
        title=title,
        x_label=time_label,
        x_scale="time",
        y_label=f"{name} NEES per dimension",
        series=(
            Series("95 % band", found.time_s, found.low, "band", found.high, key="band"),
            Series("mean over aircraft", found.time_s, found.mean_by_time, key="mean"),
        ),
        group="Covariance consistency (NEES)",
        y_limits=(0.0, top),
        name=f"nees-{name}",
    )


def bias_plot(one: BiasHistory, time_label: str) -> Plot:
    """Return a bias over time, with ± 2 sigma and its truth where that is known.

    Parameters
    ----------
    one : BiasHistory
        The bias.
    time_label : str
        Label of the time axis.

    Returns
    -------
    Plot
        With limits that show it settled.
    """
    unit = _UNITS.get(one.parameter.rpartition("_")[2], "")
    series = [
        Series(
            "2 sigma", one.time_s, one.estimate - 2.0 * one.sigma, "band",
            one.estimate + 2.0 * one.sigma, key="estimate",
        ),
        Series("estimate", one.time_s, one.estimate, key="estimate"),
    ]  # fmt: skip
    if np.isfinite(one.true).any():
        series.append(Series("truth", one.time_s, one.true, "dashed", key="ink"))
    late = slice(len(one.time_s) // 10, None)
    low = float(np.min(one.estimate[late] - 3.0 * one.sigma[late]))
    high = float(np.max(one.estimate[late] + 3.0 * one.sigma[late]))
    limits = (low, high) if high > low else None
    name = one.parameter.removesuffix("_m").removesuffix("_deg").removesuffix("_s")
    return Plot(
        title=f"{one.sensor_id}: {name.replace('_', ' ')}",
        x_label=time_label,
        x_scale="time",
        y_label=f"{name.replace('_', ' ')}, {unit}",
        series=tuple(series),
        group="Biases",
        y_limits=limits,
        name=f"bias-{one.sensor_id}-{name}",
    )
