r"""Prints the tables of validation/restoration.md: bundle, IMM and smoother on the same scenes.

::

    python -m validation.motion.check_restoration  # three seeds, some minutes
    python -m validation.motion.check_restoration --first-seed 40 --runs 1
    python -m validation.motion.check_restoration --first-seed 60 --runs 1 --aircraft 10 \
        --straight 40 --extent 100e3
    python -m validation.motion.check_restoration --first-seed 61 --runs 1 --aircraft 10 \
        --extent 300e3
    python -m validation.motion.check_restoration --first-seed 62 --runs 1 --aircraft 10

Aircraft fly as in check_manoeuvres.py, detected by the radars of the sample with known biases. The
bundle was tuned on seeds 20 to 25; the tables use others. Four kinds of traffic: turns of at most
22° of bank, within the bundle's limit of 4 m/s²; the same with 3 % of the plots moved by 0.3 to
3 km; turns of up to 30° with a limit of 6 m/s²; and the same beyond the limit of 4 m/s². The IMM is
the tracker's `imm`, the smoother `evaluation.imm_smoothing` over the plots up to now. Compared are
RMS position errors: at the newest plot, and at the plots of the last 90 s, estimated now (by the
IMM: estimated then).
"""

import argparse
import copy
from dataclasses import dataclass, replace
from itertools import pairwise
from time import process_time

import numpy as np
from numpy.typing import NDArray

from multiradar.evaluation.smoothing.motion_modes import civil_modes
from multiradar.evaluation.smoothing.multiple_modes import ResidualBiases, smooth_modes
from multiradar.evaluation.smoothing.single_mode import PositionMeasurements
from multiradar.research.bundle.published import PublishedBundle
from multiradar.restoration.bundle.estimate import BEST, WEIGHTED
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import measurement_track
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from validation.motion.check_manoeuvres import CLASSES, TURN, Flown, flights
from validation.motion.check_smoothers import Seen, in_place

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
#: Rows of plots for the smoother, rows of the last 90 s, squared errors there by each method.
Old = tuple[Integers, Integers, Floats]

SETTLED_S, PAST_S = 60.0, 90.0
#: Interval between estimates of the past, and duration of the plots for the smoother, s.
EVERY_S, SMOOTHED_S = 20.0, 240.0
WRONG_SHARE, WRONG_M = 0.03, (300.0, 3000.0)
OUTLIER_DENSITY = 30.0
#: An aircraft is lost after this error in this number of consecutive plots.
LOST_M, LOST_PLOTS = 1000.0, 3
#: A turn reported this long after the end of the last one is false, s.
FALSE_AFTER_S = 30.0


@dataclass(frozen=True)
class Estimates:
    """Estimates of one method at the plots of a scenario, NaN where there are none.

    Positions (n, 2), probability of a turn (n,), half of error² / sigma² (n,).
    """

    position_m: Floats
    turning: Floats
    squared: Floats


@dataclass(frozen=True)
class Aircraft:
    """Plots of one aircraft, and the estimates of the IMM at all plots."""

    seen: Seen
    rows: Integers
    imm: Estimates


@dataclass(frozen=True)
class Past:
    """Squared position errors over the last 90 s: bundle, its best track, IMM and smoother."""

    squared_m2: Floats
    doing: Integers


@dataclass(frozen=True)
class Found:
    """All results of one scenario."""

    seen: Seen
    bundle: Estimates
    best: Floats
    imm: Estimates
    past: Past
    seconds: float
    restarts: int


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="seeds")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--aircraft", type=int, default=12, help="in each run")
    parser.add_argument("--duration", type=float, default=600.0, help="of each run, s")
    parser.add_argument("--straight", type=float, default=120.0, help="mean straight leg, s")
    parser.add_argument("--extent", type=float, default=150e3, help="traffic begins within ±, m")
    parser.add_argument("--tracks", type=int, default=16, help="of each bundle")
    options = parser.parse_args()
    usual = BundleSettings(tracks_max=options.tracks)
    for title, bank_deg, share, settings in (
        ("clean plots, banks of up to 22°", 22.0, 0.0, usual),
        ("3 % of the plots wrong, banks of up to 22°", 22.0, WRONG_SHARE, usual),
        ("clean plots, banks of up to 30°", 30.0, 0.0, replace(usual, lateral_max_mps2=6.0)),
        ("clean plots, banks of up to 30°, limit of 4 m/s²", 30.0, 0.0, usual),
    ):
        found = []
        for seed in range(options.first_seed, options.first_seed + options.runs):
            (flown,) = flights(
                1, aircraft=options.aircraft, duration_s=options.duration, known=True,
                first_seed=seed, bank_max_deg=bank_deg, straight_s=options.straight,
                extent_m=options.extent,
            )  # fmt: skip
            found.append(compare(moved(flown, share, seed), settings))
        print(f"**{title}**\n", flush=True)
        report(found)
    print_searches(usual, options.first_seed)


def print_searches(settings: BundleSettings, seed: int, aircraft: int = 6) -> None:
    """Print CPU time and misfit of the optimisation of a track by either method."""
    (flown,) = flights(
        1, aircraft=aircraft, duration_s=240.0, known=True, first_seed=seed, bank_max_deg=22.0
    )
    seen = in_place(flown).sightings
    spent: dict[str, list[float]] = {"search of Hooke and Jeeves": [], "least squares": []}
    left: dict[str, list[float]] = {name: [] for name in spent}
    for number in np.unique(seen.aircraft):
        chosen = seen.select(
            np.flatnonzero(
                (seen.aircraft == number) & (seen.time_s > 100.0) & (seen.time_s < 190.0)
            )
        )
        radar = np.zeros(len(chosen))
        plots = measurement_track(chosen.time_s, chosen.position_m, chosen.covariance_m2, radar)
        known = int(np.searchsorted(plots.time_s, plots.time_s[0] + 30.0))
        started = PublishedBundle(plots, replace(settings, apart_m=20.0))
        started.start(known)
        for count in range(known, len(plots) + 1):
            started.branch(count)
            started.thin(count)
        for name in spent:
            bundle = copy.deepcopy(started)
            improve = bundle.fit_least_squares if name == "least squares" else bundle.optimise
            if number == seen.aircraft[0]:
                improve(len(plots))
                bundle = copy.deepcopy(started)
                improve = bundle.fit_least_squares if name == "least squares" else bundle.optimise
            began = process_time()
            improve(len(plots))
            spent[name].append(1e3 * (process_time() - began) / len(bundle))
            left[name].append(bundle.misfits(len(plots)).min())
    print("**optimisation of a track over 90 s of plots, the report's functional**\n")
    for name in spent:
        print(
            f"- {name}: {np.mean(spent[name]):.2f} ms a track, at most {max(spent[name]):.2f} ms; "
            f"misfit of the best {np.mean(left[name]):.1f}"
        )


def moved(one: Flown, share: float, seed: int) -> Flown:
    """Return a scenario with a fraction of its plots moved in random directions."""
    rng = np.random.Generator(np.random.PCG64([seed, 90]))
    count = len(one.batch)
    wrong = rng.uniform(size=count) < share
    size, angle = rng.uniform(*WRONG_M, count), rng.uniform(0.0, 2.0 * np.pi, count)
    far, around = wrong * size * np.cos(angle), wrong * size * np.sin(angle)
    azimuth = one.batch.azimuth_rad + around / one.batch.range_m
    batch = replace(
        one.batch,
        range_m=np.abs(one.batch.range_m + far),
        azimuth_rad=azimuth % (2.0 * np.pi),
    )
    return replace(one, batch=batch)


def compare(flown: Flown, settings: BundleSettings) -> Found:
    """Run all three methods on one scenario."""
    seen = in_place(flown)
    imm = imm_estimates(flown, seen)
    count = len(seen.sightings)
    bundle = Estimates(np.full((count, 2), np.nan), np.full(count, np.nan), np.full(count, np.nan))
    best = np.full((count, 2), np.nan)
    pasts: list[Old] = []
    seconds, restarts = 0.0, 0
    for aircraft in np.unique(seen.sightings.aircraft):
        rows = np.flatnonzero(seen.sightings.aircraft == aircraft)
        one = Aircraft(seen, rows, imm)
        spent, again = follow(one, settings, bundle, best, pasts)
        seconds, restarts = seconds + spent, restarts + again
    past = smoothed(seen, pasts)
    return Found(seen, bundle, best, imm, past, seconds, restarts)


def follow(
    one: Aircraft, settings: BundleSettings, estimates: Estimates, best: Floats, pasts: list[Old]
) -> tuple[float, int]:
    """Process one aircraft with a bundle; return CPU time and number of restarts."""
    seen, rows, spent, next_s = one.seen, one.rows, 0.0, SETTLED_S + PAST_S
    sightings = seen.sightings
    bundle = Bundle(settings)
    for k, row in enumerate(rows):
        time_s = float(sightings.time_s[row])
        began = process_time()
        bundle.push(time_s, sightings.position_m[row], sightings.covariance_m2[row])
        spent += process_time() - began
        if not len(bundle) or time_s < SETTLED_S:
            continue
        now = bundle.estimate()
        off = now.state[:2] - seen.true_m[row]
        estimates.position_m[row] = now.state[:2]
        estimates.turning[row] = now.kind_probability[1] + now.kind_probability[2]
        estimates.squared[row] = off @ np.linalg.solve(now.covariance[:2, :2], off) / 2.0
        best[row] = bundle.restored([time_s], BEST).position_m[0]
        if time_s >= next_s:
            next_s = time_s + EVERY_S
            pasts.append(past_of(one, bundle, rows[: k + 1], time_s))
    return spent, bundle.restarts


def past_of(one: Aircraft, bundle: Bundle, rows: Integers, time_s: float) -> Old:
    """Return rows for the smoother, rows of the last 90 s, and squared errors there."""
    times = one.seen.sightings.time_s[rows]
    old, known = rows[times > time_s - PAST_S], rows[times > time_s - SMOOTHED_S]
    when = one.seen.sightings.time_s[old]
    places = [bundle.restored(when, by).position_m for by in (WEIGHTED, BEST)]
    squares = np.sum(
        (np.array([*places, one.imm.position_m[old]]) - one.seen.true_m[old]) ** 2, axis=-1
    )
    return known, old, squares


def smoothed(seen: Seen, pasts: list[Old]) -> Past:
    """Smooth all windows at once, each as a separate aircraft."""
    every = np.concatenate([known for known, _, _ in pasts])
    number = np.repeat(np.arange(len(pasts)), [len(known) for known, _, _ in pasts])
    chosen = seen.sightings.select(every)
    apart = PositionMeasurements(number, chosen.time_s, chosen.position_m, chosen.covariance_m2)
    biases = ResidualBiases(seen.biases.sensitivity[every], seen.biases.covariance)
    state = smooth_modes(apart, civil_modes(), OUTLIER_DENSITY, biases).state
    squares, doing = [], []
    for i, (_, old, estimates) in enumerate(pasts):
        places = state[number == i][-len(old) :, :2]
        smooth = np.sum((places - seen.true_m[old]) ** 2, axis=-1)
        squares.append(np.vstack([estimates, smooth]))
        doing.append(seen.doing[old])
    return Past(np.concatenate(squares, axis=1), np.concatenate(doing))


def imm_estimates(flown: Flown, seen: Seen) -> Estimates:
    """Return the estimates of the filter of interacting modes at the plots."""
    engine = Engine(flown.sensors, TrackingSettings(filter_name="imm"))
    parts = [engine.push(flown.batch).updates, engine.flush().updates]
    updates = TrackUpdates.concatenate(parts)
    place = np.stack(engine.plane.to_plane(updates.latitude_rad, updates.longitude_rad), axis=-1)
    turning = updates.turn_right_probability + updates.turn_left_probability
    keys = zip(updates.track_number - 1, updates.time_s, strict=True)
    number = {key: i for i, key in enumerate(keys)}
    sightings = seen.sightings
    found = [number.get(key, -1) for key in zip(sightings.aircraft, sightings.time_s, strict=True)]
    row = np.array(found)
    missing = row < 0
    off = place[row] - seen.true_m
    # The sigma is the root of the sum of both variances.
    squared = np.sum(off**2, axis=1) / updates.position_sigma_m[row] ** 2
    return Estimates(
        np.where(missing[:, None], np.nan, place[row]),
        np.where(missing, np.nan, turning[row]),
        np.where(missing, np.nan, squared),
    )


def report(found: list[Found]) -> None:
    """Print the tables of one traffic."""
    print(f"| | {' | '.join(CLASSES)} |\n|{'---|' * (1 + len(CLASSES))}")
    for name, positions in (
        ("now, bundle", [one.bundle.position_m for one in found]),
        ("now, best track", [one.best for one in found]),
        ("now, `imm`", [one.imm.position_m for one in found]),
    ):
        print(f"| {name} | {' | '.join(now_cells(found, positions))} |")
    names = ("bundle", "best track", "`imm`", "smoother up to now")
    for which, name in enumerate(names):
        squares = np.concatenate([one.past.squared_m2[which] for one in found])
        doing = np.concatenate([one.past.doing for one in found])
        cells = [metres(squares[np.isin(doing, kinds)]) for kinds in CLASSES.values()]
        print(f"| last 90 s, {name} | {' | '.join(cells)} |")
    print()
    for name, each in (("bundle", [o.bundle for o in found]), ("`imm`", [o.imm for o in found])):
        print(f"- {name}: {sentence(found, each)}")
    plots = sum(len(one.seen.sightings) for one in found)
    spent = 1e3 * sum(one.seconds for one in found) / plots
    print(
        f"- steps of the bundle: {spent:.2f} ms a plot; restarts {sum(o.restarts for o in found)}\n"
    )


def now_cells(found: list[Found], positions: list[Floats]) -> list[str]:
    """Return root mean squares at the newest plot, by what the aircraft does."""
    squares, doing = [], []
    for one, position in zip(found, positions, strict=True):
        # Plots rejected by the tracker have no estimate; none is evaluated there.
        both = np.isfinite(one.bundle.turning) & np.isfinite(one.imm.turning)
        kept = both & (one.seen.sightings.time_s > SETTLED_S)
        squares.append(np.sum((position - one.seen.true_m)[kept] ** 2, axis=1))
        doing.append(one.seen.doing[kept])
    square, kinds = np.concatenate(squares), np.concatenate(doing)
    return [metres(square[np.isin(kinds, which)]) for which in CLASSES.values()]


def metres(squares: Floats) -> str:
    """Return a root mean square; missing estimates are ignored."""
    return f"{np.sqrt(np.nanmean(squares)):.1f} m"


def sentence(found: list[Found], each: list[Estimates]) -> str:
    """Return delays, false turns, the squared error over its sigma, and losses."""
    starts: list[float] = []
    ends: list[float] = []
    false: list[Flags] = []
    squared, lost = [], 0
    for one, estimates in zip(found, each, strict=True):
        for aircraft in np.unique(one.seen.sightings.aircraft):
            rows = np.flatnonzero(
                (one.seen.sightings.aircraft == aircraft) & (one.seen.sightings.time_s > SETTLED_S)
            )
            off = np.hypot(*(estimates.position_m[rows] - one.seen.true_m[rows]).T)
            lost += is_lost(off)
            evaluated = rows[np.isfinite(estimates.turning[rows])]
            times, turns = one.seen.sightings.time_s[evaluated], one.seen.doing[evaluated] == TURN
            started, ended, wrong = delays(times, turns, estimates.turning[evaluated] > 0.5)
            starts, ends, false = starts + started, ends + ended, [*false, wrong]
        squared.append(estimates.squared[np.isfinite(estimates.squared)])
    return (
        f"turns reported {np.mean(starts):.1f} s after their start and {np.mean(ends):.1f} s after "
        f"their end ({len(starts)} turns), {100.0 * np.mean(np.concatenate(false)):.2f} % of "
        f"straight flight reported as turns, error² / sigma² "
        f"{np.mean(np.concatenate(squared)):.2f}, {lost} aircraft lost"
    )


def delays(times: Floats, turns: Flags, reported: Flags) -> tuple[list[float], list[float], Flags]:
    """Return the delays of reported starts and ends of turns, and what is reported later.

    Unreported ones count to the end.
    """
    starts: list[float] = []
    ends: list[float] = []
    false = [np.zeros(0, np.bool_)]
    cuts = [*(np.flatnonzero(np.diff(turns.astype(int))) + 1).tolist(), len(turns)]
    for first, last in pairwise(cuts):
        right = np.flatnonzero(reported[first:last] == turns[first])
        until = first + right[0] if len(right) else last - 1
        (starts if turns[first] else ends).append(float(times[until] - times[first]))
        if not turns[first]:
            false.append(reported[first:last][times[first:last] > times[first] + FALSE_AFTER_S])
    return starts, ends, np.concatenate(false)


def is_lost(off: Floats) -> bool:
    """Return whether `LOST_PLOTS` consecutive errors are large or missing."""
    large = ~(off < LOST_M)
    runs = np.convolve(large.astype(int), np.ones(LOST_PLOTS, int), mode="valid")
    return bool((runs >= LOST_PLOTS).any())


if __name__ == "__main__":
    main()
