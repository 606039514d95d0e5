"""The figures of a scorecard as one object for programs."""

import dataclasses
import math

import numpy as np

from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.measures.consistency import Consistency
from multiradar.evaluation.measures.forecast_errors import ForecastErrors
from multiradar.evaluation.scorecard import Scorecard
from multiradar.evaluation.trajectories import Floats, RowCounts

#: A false track that lives longer is counted separately, s.
LONG_LIFE_S = 30.0
#: Rejected rows of a reference that are listed.
REJECTS_MAX = 1000
_HOUR_S = 3600.0

Figure = float | int | str | bool | None
Figures = dict[str, "Figure | Figures | list[Figures]"]


def figures_of(card: Scorecard) -> Figures:
    """Return the object that ``--json`` prints.

    Parameters
    ----------
    card : Scorecard
        All measures.

    Returns
    -------
    dict
        Plain Python values, every number finite, None in place of what is not; described in
        ``docs/howto/scorecard.md``.
    """
    errors = card.errors
    return {
        "settings": {name: value for name, value in dataclasses.asdict(card.settings).items()},
        "compared": _compared(card),
        "errors": {
            "position_m": summary(errors.position_m),
            "along_m": summary(errors.along_m),
            "across_m": summary(errors.across_m),
            "velocity_mps": summary(errors.velocity_mps),
            "speed_mps": summary(errors.speed_mps),
            "heading_deg": summary(errors.heading_deg),
            "height_m": summary(errors.height_m),
            "climb_mps": summary(errors.climb_mps),
        },
        "siap": dataclasses.asdict(card.siap),
        "ospa": _ospa(card),
        "gospa": _gospa(card),
        "nees": {"position": _nees(card.position), "velocity": _nees(card.velocity)},
        "initiation": _initiation(card),
        "continuity": _continuity(card),
        "identity": _identity(card),
        "tracks": _tracks(card),
        "presets": [
            {
                "preset": one.preset,
                "requirement": one.requirement.text,
                "limit": one.requirement.limit,
                "at_least": one.requirement.at_least,
                "unit": one.requirement.unit,
                "found": _finite(one.found.value),
                "samples": one.found.samples,
                "verdict": str(one.outcome),
            }
            for one in card.preset_results
        ],
        "biases": [_bias(one) for one in card.biases],
        "differences": [dataclasses.asdict(one) for one in card.differences],
        "forecasts": [] if card.forecasts is None else _forecasts(card.forecasts),
        "aircraft": by_aircraft(card),
    }


def summary(values: Floats) -> Figures:
    """Return count, mean, root mean square, median, 95 % and largest of values.

    Parameters
    ----------
    values : (n,) float64
        Signed errors; NaN is skipped.

    Returns
    -------
    dict
        Median, 95 % and largest refer to absolute values; None where there are no values.
    """
    known = values[np.isfinite(values)]
    names = ("mean", "rms", "median", "p95", "largest")
    if not len(known):
        return {"samples": 0, **dict.fromkeys(names)}
    size = np.abs(known)
    found = (
        known.mean(), np.sqrt(np.mean(known**2)), np.median(size), np.percentile(size, 95.0),
        size.max(),
    )  # fmt: skip
    return {"samples": len(known), **dict(zip(names, map(float, found), strict=True))}


def row_figures(counts: RowCounts) -> Figures:
    """Return the counts of the rows of a reference, and its first `REJECTS_MAX` rejects.

    Parameters
    ----------
    counts : RowCounts
        Disposition of the rows.

    Returns
    -------
    dict
        `rows`, and `rejects` with the fields of `rejects.ndjson` that locate and explain a reject.
    """
    rows: Figures = {
        "read": counts.read,
        "accepted": counts.accepted,
        "rejected": len(counts.rejects),
        "duplicate": counts.duplicate,
        "outside_time": counts.uncovered.time,
        "outside_range": counts.uncovered.range,
        "below_horizon": counts.uncovered.horizon,
    }
    rejects: list[Figures] = [dataclasses.asdict(one) for one in counts.rejects[:REJECTS_MAX]]
    return {"rows": rows, "rejects": rejects}


def by_aircraft(card: Scorecard) -> list[Figures]:
    """Return the figures of each aircraft.

    Parameters
    ----------
    card : Scorecard
        All measures.

    Returns
    -------
    list of dict
        Sorted by name.
    """
    count = len(card.reference.names)
    instants, errors = card.instants, card.errors
    known = np.bincount(instants.aircraft, minlength=count)
    tracked = np.bincount(instants.aircraft[instants.track_of >= 0], minlength=count)
    longest_gap = np.zeros(count)
    np.maximum.at(longest_gap, card.interval_aircraft, card.interval_s)
    order = np.argsort(errors.aircraft, kind="stable")
    ends = np.searchsorted(errors.aircraft[order], np.arange(count + 1))
    rows: list[Figures] = []
    for number, name in enumerate(card.reference.names):
        own = order[ends[number] : ends[number + 1]]
        position = summary(errors.position_m[own])
        rows.append(
            {
                "aircraft": str(name),
                "completeness": _fraction(int(tracked[number]), int(known[number])),
                "tracks": len({run.partner for run in card.identity.tracks_of_aircraft[number]}),
                "updates": position["samples"],
                "rms_m": position["rms"],
                "median_m": position["median"],
                "p95_m": position["p95"],
                "along_rms_m": summary(errors.along_m[own])["rms"],
                "across_rms_m": summary(errors.across_m[own])["rms"],
                "delay_s": _finite(float(card.delay_s[number])),
                "longest_gap_s": float(longest_gap[number]),
            }
        )
    return rows


def _compared(card: Scorecard) -> Figures:
    times = card.instants.time_s
    return {
        "aircraft": len(card.reference.names),
        "reference_positions": len(card.reference.time_s),
        "tracks": len(card.tracks.ids),
        "tracks_initiated": card.tracks.initiated,
        "tracks_confirmed": card.tracks.confirmed,
        "updates": len(card.tracks.time_s),
        "updates_compared": len(card.errors.update),
        "begin_s": float(times[0]) if len(times) else None,
        "duration_s": _duration_s(card),
        "instants": len(times),
    }


def _duration_s(card: Scorecard) -> float:
    return float(np.ptp(card.reference.time_s))


def _ospa(card: Scorecard) -> Figures:
    values = card.distances.ospa_m[card.distances.present]
    return {
        "cutoff_m": card.settings.cutoff_m,
        "order": card.settings.order,
        "mean_m": _mean(values),
        "median_m": _median(values),
        "largest_m": float(values.max()) if len(values) else None,
    }


def _gospa(card: Scorecard) -> Figures:
    found = card.distances
    values = found.gospa_m[found.present]
    parts = {"localisation": found.localisation, "missed": found.missed, "false": found.false_}
    total = sum(float(part.sum()) for part in parts.values())
    fractions: Figures = {
        f"{name}_share": _fraction(float(part.sum()), total) for name, part in parts.items()
    }
    return {"mean_m": _mean(values), "median_m": _median(values), **fractions}


def _nees(found: Consistency | None) -> Figures:
    if found is None:
        return {"samples": 0, "mean": None, "inside_95": None, "bins": 0, "bins_inside_95": None}
    return {
        "samples": found.samples,
        "mean": _finite(found.mean),
        "inside_95": found.inside,
        "bins": len(found.time_s),
        "bins_inside_95": found.inside_by_time,
    }


def _initiation(card: Scorecard) -> Figures:
    known = card.delay_s[np.isfinite(card.delay_s)]
    found = summary(known)
    figures: Figures = {
        "aircraft": len(card.delay_s),
        "never_tracked": int(np.sum(np.isinf(card.delay_s))),
        "median_s": found["median"],
        "p95_s": found["p95"],
        "longest_s": found["largest"],
    }
    period = card.settings.scan_period_s
    if period is not None and len(known):
        figures["median_scans"] = float(np.median(known)) / period
        figures["longest_scans"] = float(known.max()) / period
    return figures


def _continuity(card: Scorecard) -> Figures:
    length = card.interval_s
    gaps = length[length >= card.settings.gap_s]
    total = float(length.sum())
    return {
        "continuity": _fraction(total - float(gaps.sum()), total),
        "intervals": len(length),
        "gap_s": card.settings.gap_s,
        "gaps": len(gaps),
        "gap_share": _fraction(len(gaps), len(length)),
        "gap_time_share": _fraction(float(gaps.sum()), total),
        "longest_gap_s": float(length.max()) if len(length) else None,
    }


def _identity(card: Scorecard) -> Figures:
    hours = _duration_s(card) / _HOUR_S
    right, total = card.plots or (0, 0)
    return {
        "swaps": card.identity.swaps,
        "swaps_per_h": _fraction(card.identity.swaps, hours),
        "number_changes": card.identity.number_changes,
        "plots_judged": total,
        "plots_on_right_track": _fraction(right, total),
    }


def _tracks(card: Scorecard) -> Figures:
    found = card.track_classes
    wrong, twice = found.life_s[found.false_], found.life_s[found.duplicate]
    evaluated = found.true | found.duplicate | found.false_
    return {
        "of_aircraft": int(found.true.sum()),
        "duplicate": len(twice),
        "duplicate_longest_s": float(twice.max()) if len(twice) else None,
        "false": len(wrong),
        "false_longest_s": float(wrong.max()) if len(wrong) else None,
        "false_longer_than_30_s": int(np.sum(wrong > LONG_LIFE_S)),
        "not_judged": int(np.sum(~evaluated)),
    }


def _bias(one: BiasHistory) -> Figures:
    last = one.last
    error, sigma = one.estimate[last] - one.true[last], one.sigma[last]
    known = np.isfinite(one.true) & (one.sigma > 0.0)
    squared = ((one.estimate - one.true)[known] / one.sigma[known]) ** 2
    return {
        "sensor_id": one.sensor_id,
        "parameter": one.parameter,
        "time_s": float(one.time_s[last]),
        "estimate": float(one.estimate[last]),
        "sigma": float(sigma),
        "true": _finite(float(one.true[last])),
        "error": _finite(float(error)),
        "error_over_sigma": _finite(float(error / sigma)) if sigma > 0.0 else None,
        "nees": _mean(squared),
    }


def _forecasts(found: ForecastErrors) -> list[Figures]:
    rows: list[Figures] = []
    kinds = sorted(
        set(
            zip(
                found.by.tolist(), found.horizon_s.tolist(), found.probability.tolist(), strict=True
            )
        )
    )
    for by, horizon_s, probability in kinds:
        own = (found.by == by) & (found.horizon_s == horizon_s)
        own &= found.probability == probability
        errors = summary(found.error_m[own])
        rows.append(
            {
                "by": by,
                "horizon_s": horizon_s,
                "probability": probability,
                "samples": errors["samples"],
                "inside": float(np.mean(found.inside[own])),
                "median_m": errors["median"],
                "rms_m": errors["rms"],
                "nees": float(np.mean(found.normalised[own])),
                "radius_median_m": float(np.median(found.radius_m[own])),
            }
        )
    return rows


def _mean(values: Floats) -> float | None:
    return float(values.mean()) if len(values) else None


def _median(values: Floats) -> float | None:
    return float(np.median(values)) if len(values) else None


def _fraction(part: float, whole: float) -> float | None:
    return part / whole if whole else None


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
