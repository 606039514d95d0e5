r"""Prints validation/restoration.md on the delay of turn detection at equal false rates.

::

    python -m validation.motion.check_turn_delays  # twelve seeds of five traffics, half an hour
    python -m validation.motion.check_turn_delays --runs 3 --traffic "banks of up to 22°"

Aircraft, radars and measures are those of check_restoration.py; the seeds differ from those of its
tables and of tuning. A turn is detected when its probability exceeds a threshold. The natural
threshold is 0.5; any other trades delay for false turns, for `imm` and bundle alike, so delays are
compared at thresholds of equal rates of false turns. Differences are given with their standard
deviation over aircraft (bootstrap).

The exact sum is not a filter. It knows that only turns end straight flight, when straight flight
started, and that banks are uniform from 10° to the largest; it sums over all starts and banks. It
is compared only where these assumptions hold: not during changes of speed, nor after them or after
turns until there are 20 s of straight flight, nor with wrong plots or short straight flight. Data
before straight flight are not used.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from validation.motion.check_manoeuvres import GRAVITY_MPS2, SPEEDING, STRAIGHT, TURN, flights
from validation.motion.check_restoration import SETTLED_S, WRONG_SHARE, delays, imm_estimates, moved
from validation.motion.check_smoothers import Seen, in_place

Floats = NDArray[np.float64]

DURATION_S = 600.0
TURNING = ("right", "left")
RATES = (0.5, 0.75, 1.0, 1.5, 2.0)
#: Logarithms of the odds thresholds for a turn; the middle one is a probability of 0.5.
ODDS = np.linspace(-8.0, 8.0, 161)
RESAMPLED = 400
#: Rows of counts of an aircraft: sum of delays, turns, false turn rows, evaluated straight rows.
DELAY_S, TURNS, FALSE, STRAIGHTS = range(4)
#: The exact sum: window, least straight flight in it, earliest start of a turn before now, step of
#: starts, s; turns per second; number of banks on each side, smallest bank.
WINDOW_S, LEAST_S, BACK_S, STEP_S = 90.0, 20.0, 40.0, 1.0
TURN_RATE, BANKS, LEAST_BANK_DEG = 0.01, 6, 10.0


@dataclass(frozen=True)
class Traffic:
    """Motion and initial area of aircraft, and fraction of wrong plots."""

    bank_deg: float = 22.0
    lateral_max_mps2: float = 4.0
    wrong: float = 0.0
    straight_s: float = 120.0
    extent_m: float = 150e3


TRAFFICS = {
    "banks of up to 22°": Traffic(),
    "3 % of the plots wrong": Traffic(wrong=WRONG_SHARE),
    "banks of up to 30°, limit of 6 m/s²": Traffic(30.0, 6.0),
    "turning all the time": Traffic(straight_s=40.0, extent_m=100e3),
    "few radars, far away": Traffic(extent_m=300e3),
}


def main() -> None:
    """Print one table for each traffic."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=12, help="seeds")
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--aircraft", type=int, default=12, help="in each run")
    parser.add_argument("--traffic", choices=TRAFFICS, nargs="+", default=list(TRAFFICS))
    options = parser.parse_args()
    for name in options.traffic:
        found: dict[str, list[Floats]] = {}
        for seed in range(options.first_seed, options.first_seed + options.runs):
            for method, counts in counts_of(TRAFFICS[name], seed, options.aircraft).items():
                found.setdefault(method, []).append(counts)
        print(f"**{name}**\n")
        report({method: np.concatenate(parts) for method, parts in found.items()})


def counts_of(traffic: Traffic, seed: int, aircraft: int) -> dict[str, Floats]:
    """Return the counts of one scenario for both methods, and for the exact sum where it holds."""
    (flown,) = flights(
        1, aircraft=aircraft, duration_s=DURATION_S, known=True, first_seed=seed,
        bank_max_deg=traffic.bank_deg, straight_s=traffic.straight_s, extent_m=traffic.extent_m,
    )  # fmt: skip
    flown = moved(flown, traffic.wrong, seed)
    seen = in_place(flown)
    turning_by_method = {
        "`imm`": imm_estimates(flown, seen).turning,
        "bundle": bundle_probabilities(
            seen, BundleSettings(lateral_max_mps2=traffic.lateral_max_mps2)
        ),
    }
    if not traffic.wrong and traffic.straight_s > WINDOW_S:
        exact = sum_probabilities(seen, traffic.bank_deg)
        for method in list(turning_by_method):
            turning_by_method[f"{method}, where the sum holds"] = np.where(
                np.isnan(exact), np.nan, turning_by_method[method]
            )
        turning_by_method["exact sum"] = exact
    return {method: counted(seen, turning) for method, turning in turning_by_method.items()}


def bundle_probabilities(seen: Seen, settings: BundleSettings) -> Floats:
    """Return the probability of a turn by bundles at the plots."""
    sightings = seen.sightings
    turning = np.full(len(sightings), np.nan)
    for aircraft in np.unique(sightings.aircraft):
        bundle = Bundle(settings)
        for row in np.flatnonzero(sightings.aircraft == aircraft):
            time_s = float(sightings.time_s[row])
            bundle.push(time_s, sightings.position_m[row], sightings.covariance_m2[row])
            if len(bundle) and time_s >= SETTLED_S:
                # As in `estimate`, without the covariance, which takes most of the CPU time.
                turning[row] = sum(
                    one.weight
                    for one in bundle.trajectories()
                    if one.kinds[int(np.sum(one.controls.begin_s[1:] <= time_s))] in TURNING
                )
    return turning


def sum_probabilities(seen: Seen, bank_max_deg: float) -> Floats:
    """Return the probability of a turn given the traffic model, NaN where it does not hold."""
    sightings = seen.sightings
    turning = np.full(len(sightings), np.nan)
    banks = np.radians(np.linspace(LEAST_BANK_DEG, bank_max_deg, BANKS))
    lateral = GRAVITY_MPS2 * np.tan(np.concatenate([banks, -banks]))
    for aircraft in np.unique(sightings.aircraft):
        rows = np.flatnonzero(sightings.aircraft == aircraft)
        time_s, doing = sightings.time_s[rows], seen.doing[rows]
        information = np.linalg.inv(sightings.covariance_m2[rows])
        root = np.linalg.cholesky(information).swapaxes(1, 2)
        straight_since_s = time_s[0]
        for k, row in enumerate(rows):
            if k and doing[k] == STRAIGHT != doing[k - 1]:
                straight_since_s = time_s[k]
            first = int(np.searchsorted(time_s, max(straight_since_s, time_s[k] - WINDOW_S)))
            known = time_s[k] - time_s[first] >= LEAST_S and k - first >= BANKS
            if known and doing[k] != SPEEDING and time_s[k] >= SETTLED_S:
                part = slice(first, k + 1)
                position_m = sightings.position_m[rows[part]]
                turning[row] = probability(
                    time_s[part] - time_s[k], position_m, root[part], lateral
                )
    return turning


def probability(time_s: Floats, position_m: Floats, root: Floats, lateral_mps2: Floats) -> float:
    """Return the probability that straight flight has become a turn by the last plot, at time 0.

    Course and speed for the shape of a turn are those of the first half of the plots; position and
    velocity are free parameters of each turn.
    """
    many = len(time_s)
    flown = np.zeros((many, 2, 4))
    flown[:, 0, 0] = flown[:, 1, 1] = 1.0
    flown[:, 0, 2] = flown[:, 1, 3] = time_s
    design = (root @ flown).reshape(2 * many, 4)
    plots = np.einsum("nij,nj->ni", root, position_m).ravel()
    before = 2 * max(many // 2, 3)
    velocity = np.linalg.lstsq(design[:before], plots[:before], rcond=None)[0][2:]
    speed = float(np.hypot(*velocity))
    ahead = velocity / speed
    right = np.array([ahead[1], -ahead[0]])
    begins = np.arange(max(-BACK_S, time_s[0]), 0.0, STEP_S) + 0.5 * STEP_S
    angle = np.maximum(time_s[:, None, None] - begins[:, None], 0.0) * lateral_mps2 / speed
    radius = speed**2 / lateral_mps2
    off = (radius * (np.sin(angle) - angle))[..., None] * ahead
    off += (radius * (1.0 - np.cos(angle)))[..., None] * right
    turns = np.einsum("nij,nbuj->nibu", root, off).reshape(2 * many, -1)
    straight = np.linalg.qr(design)[0]
    plots -= straight @ (straight.T @ plots)
    turns -= straight @ (straight.T @ turns)
    logarithm = turns.T @ plots - 0.5 * np.sum(turns**2, axis=0)
    logarithm += np.log(TURN_RATE * STEP_S / len(lateral_mps2))
    largest = max(float(logarithm.max()), 0.0)
    turning = float(np.sum(np.exp(logarithm - largest)))
    return turning / (turning + float(np.exp(-largest)))


def counted(seen: Seen, turning: Floats) -> Floats:
    """Return the counts of each aircraft at each threshold, (aircraft, thresholds, 4)."""
    sightings = seen.sightings
    thresholds = 1.0 / (1.0 + np.exp(-ODDS))
    numbers = np.unique(sightings.aircraft)
    counts = np.zeros((len(numbers), len(thresholds), 4))
    for i, aircraft in enumerate(numbers):
        rows = np.flatnonzero(
            (sightings.aircraft == aircraft) & (sightings.time_s > SETTLED_S) & np.isfinite(turning)
        )
        if not len(rows):
            continue
        time_s, turns = sightings.time_s[rows], seen.doing[rows] == TURN
        for j, threshold in enumerate(thresholds):
            starts, _, false = delays(time_s, turns, turning[rows] > threshold)
            counts[i, j] = sum(starts), len(starts), false.sum(), len(false)
    return counts


def at_rates(counts: Floats) -> Floats:
    """Return the mean delay at each rate of false turns, s; counts are summed over aircraft."""
    total = counts.sum(axis=0)
    delay_s, rate = total[:, DELAY_S] / total[:, TURNS], total[:, FALSE] / total[:, STRAIGHTS]
    # Where the threshold rises the rate falls.
    return np.asarray(np.interp(RATES, 100.0 * rate[::-1], delay_s[::-1]))


def difference(one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Return the difference in delay at each rate, s, and its standard deviation."""
    rng = np.random.Generator(np.random.PCG64(len(one)))
    drawn = rng.integers(len(one), size=(RESAMPLED, len(one)))
    tried = np.array([at_rates(one[rows]) - at_rates(other[rows]) for rows in drawn])
    return at_rates(one) - at_rates(other), tried.std(axis=0)


def report(counts: dict[str, Floats]) -> None:
    """Print the table of one traffic."""
    print(f"| | at one half | {' | '.join(f'{rate:g} % false' for rate in RATES)} |")
    print(f"|{'---|' * (2 + len(RATES))}")
    half = len(ODDS) // 2
    for method, each in counts.items():
        total = each[:, half].sum(axis=0)
        rate = 100.0 * total[FALSE] / total[STRAIGHTS]
        first = f"{total[DELAY_S] / total[TURNS]:.2f} s, {rate:.2f} % false"
        print(f"| {method} | {first} | {cells(at_rates(each))} |")
    for one, other in (("bundle", "`imm`"), ("exact sum", "bundle, where the sum holds")):
        if one in counts:
            later, sigma = difference(counts[one], counts[other])
            marked = " | ".join(f"{a:+.2f} ± {b:.2f} s" for a, b in zip(later, sigma, strict=True))
            print(f"| {one} less {other} | | {marked} |")
    turns = int(counts["bundle"][:, half, TURNS].sum())
    print(f"\n{turns} turns of {len(counts['bundle'])} aircraft\n", flush=True)


def cells(delay_s: Sequence[float] | Floats) -> str:
    """Return delays as cells of a table."""
    return " | ".join(f"{one:.2f} s" for one in delay_s)


if __name__ == "__main__":
    main()
