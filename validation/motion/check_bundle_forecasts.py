"""Prints the table of forecasts of howto/trajectory-forecasts.md: bundle, modes, polynomial.

::

    python -m validation.motion.check_bundle_forecasts  # three seeds of two traffics, some minutes
    python -m validation.motion.check_bundle_forecasts --straight 300 --first-seed 40 --runs 1
    # long enough to learn
    python -m validation.motion.check_bundle_forecasts --minutes 40 --bundle-alone

Aircraft fly as in check_restoration.py, banks of at most 22°: legs between whose manoeuvres lie two
minutes on average, and legs without any. Every ten seconds each aircraft is forecast
10 to 300 s ahead, by its bundle (`restoration.forecast`), by the modes of `imm`
(`tracking.forecast`) and by a polynomial (`tracking.polynomial_forecast`), from the same plots, and
compared with its true position. "bundle" has the regions of its mixture, "bundle, learnt" those
calibrated by past errors (`runtime.trajectories.ensemble_scores`), which start equal. Settings were
chosen on seeds 20 and 21; the table uses others.
"""

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.forecast.bundle_forecast import forecast
from multiradar.restoration.forecast.settings import ForecastSettings
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.trajectories.ensemble_paths import ensemble_path
from multiradar.runtime.trajectories.ensemble_scores import EnsembleScores
from multiradar.runtime.trajectories.pool import Reading
from multiradar.simulation.paths import fly
from multiradar.tracking.forecast.forecast_of_modes import forecast_modes_of, forecast_of_modes
from multiradar.tracking.forecast.polynomial_forecast import polynomial_forecast
from multiradar.tracking.forecast.region_sizes import RegionSizes
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.settings import TrackingSettings
from validation.motion.check_manoeuvres import CLASSES, Flown, doing_at, flights
from validation.motion.check_smoothers import in_place

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: By aircraft and time of its last plot: positions and covariances at all times ahead.
Forecasts = dict[tuple[int, float], tuple[Floats, Floats]]

AHEAD_S = np.array([10.0, 30.0, 60.0, 120.0, 300.0])
PROBABILITY = 0.95
MINUTES = 10.0
GRID_FIRST_S, GRID_STEP_S, SAMPLE_S = 65.0, 10.0, 8.0
#: Row titles of the methods.
METHODS = {
    "bundle": "bundle", "learnt": "bundle, learnt", "imm": "imm", "polynomial": "polynomial",
}  # fmt: skip
#: No legs between manoeuvres end within the scene.
NEVER_S = 1e6


@dataclass(frozen=True)
class Scores:
    """Forecasts by one method: squared errors, containment in the region, its area (n, times)."""

    squared_m2: Floats
    held: Floats
    area_m2: Floats


@dataclass(frozen=True)
class Found:
    """All methods over one scenario, the manoeuvres, and the CPU time of a forecast, s."""

    bundle: Scores
    learnt: Scores
    imm: Scores
    polynomial: Scores
    doing: Integers
    seconds: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="seeds")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--aircraft", type=int, default=12, help="in each run")
    parser.add_argument("--minutes", type=float, default=MINUTES)
    parser.add_argument("--bundle-alone", action="store_true", help="no other methods' rows")
    parser.add_argument("--straight", type=float, nargs="+", default=[120.0, NEVER_S],
                        help="mean straight leg, s")  # fmt: skip
    options = parser.parse_args()
    run_s = 60.0 * options.minutes
    methods = ("bundle", "learnt") if options.bundle_alone else METHODS
    seeds = range(options.first_seed, options.first_seed + options.runs)
    for straight_s in options.straight:
        found = []
        for seed in seeds:
            (flown,) = flights(
                1, aircraft=options.aircraft, duration_s=run_s + AHEAD_S[-1], known=True,
                straight_s=straight_s, first_seed=seed, bank_max_deg=22.0,
            )  # fmt: skip
            found.append(compare(flown, run_s, alone=options.bundle_alone))
        print(f"**a manoeuvre after {straight_s:g} s of straight flight on average**\n")
        report(found, methods)


def compare(flown: Flown, run_s: float, *, alone: bool) -> Found:
    """Forecast all aircraft of a scenario by all methods, or by bundles alone."""
    # Legs are flown without random numbers.
    paths = [
        fly(one, run_s + AHEAD_S[-1], np.random.Generator(np.random.PCG64(0)))
        for one in flown.fliers
    ]
    imm_forecasts = by_modes(flown, run_s)
    bundles, learnt, modes, polynomials, doing, spent = [], [], [], [], [], []
    sightings = in_place(flown).sightings
    for key, bundle, calibration in bundles_of(flown, imm_forecasts, run_s):
        began = process_time()
        ensemble = forecast(
            bundle.final_states(), AHEAD_S, ForecastSettings(), bundle.manoeuvre_history
        )
        spent.append(process_time() - began)
        truth = paths[key[0]].position(ensemble.time_s + AHEAD_S)
        factors = np.full(len(AHEAD_S), gaussian_factor(PROBABILITY))
        course = ensemble_path(Reading(bundle, 0, np.nan), ensemble.time_s + AHEAD_S, PROBABILITY)
        bundles.append(score(*course[:3], truth))
        course = ensemble_path(
            Reading(bundle, 0, np.nan, calibration), ensemble.time_s + AHEAD_S, PROBABILITY
        )
        learnt.append(score(*course[:3], truth))
        doing.append(doing_at(flown.fliers[key[0]], ensemble.time_s))
        if alone:
            continue
        modes.append(score(*imm_forecasts[key], factors, truth))
        mine = (sightings.aircraft == key[0]) & (sightings.time_s <= ensemble.time_s)
        polynomial = polynomial_forecast(
            sightings.time_s[mine], sightings.position_m[mine], sightings.covariance_m2[mine],
            ensemble.time_s + AHEAD_S,
        )  # fmt: skip
        polynomials.append(score(*polynomial, factors, truth))
    doings, seconds = np.array(doing), float(np.median(spent))
    return Found(
        joined(bundles), joined(learnt), joined(modes), joined(polynomials), doings, seconds
    )


def bundles_of(
    flown: Flown, wanted: Forecasts, run_s: float
) -> Iterator[tuple[tuple[int, float], Bundle, RegionSizes]]:
    """Process all aircraft; yield bundle and calibration at each requested plot."""
    sightings = in_place(flown).sightings
    bundles = {one: Bundle(BundleSettings()) for one in np.unique(sightings.aircraft).tolist()}
    scores, until_s = EnsembleScores(), SAMPLE_S
    fresh: list[int] = []
    order = np.argsort(sightings.time_s, kind="stable")
    for row in order[sightings.time_s[order] < run_s].tolist():
        aircraft, time_s = int(sightings.aircraft[row]), float(sightings.time_s[row])
        while time_s >= until_s:
            sample(scores, bundles, fresh, until_s)
            fresh, until_s = [], until_s + SAMPLE_S
        bundle = bundles[aircraft]
        bundle.push(time_s, sightings.position_m[row], sightings.covariance_m2[row])
        fresh.append(aircraft)
        key = aircraft, time_s
        if key in wanted and len(bundle):
            yield key, bundle, scores.sizes


def sample(
    scores: EnsembleScores, bundles: dict[int, Bundle], fresh: list[int], time_s: float
) -> None:
    """Learn from past forecasts and make some, as `runtime.trajectories.pool` does."""
    for aircraft, bundle in bundles.items():
        scores.evaluate(aircraft, bundle, time_s)
    scores.settle()
    seen = [one for one in sorted(set(fresh)) if len(bundles[one])]
    for aircraft in scores.chosen(seen, int(time_s / SAMPLE_S), len(fresh)):
        scores.make(aircraft, bundles[aircraft])


def by_modes(flown: Flown, run_s: float) -> Forecasts:
    """Return the forecasts of the modes of `imm` from the last plots before the same times."""
    settings = TrackingSettings(filter_name="imm")
    engine, table = Engine(flown.sensors, settings), forecast_modes_of(settings)
    grid_s = np.arange(GRID_FIRST_S, run_s, GRID_STEP_S)
    number: dict[int, int] = {}
    forecasts: Forecasts = {}
    before = 0
    for cut in np.searchsorted(flown.batch.time_s, grid_s).tolist():
        updates = engine.push(flown.batch.select(slice(before, cut))).updates
        number |= dict(zip(updates.track_id.tolist(), updates.track_number.tolist(), strict=True))
        before = cut
        states = engine.tracks()
        assert states.modes is not None
        known = states.modes
        for place, track in enumerate(states.track_id.tolist()):
            mean, covariance = forecast_of_modes(
                known.probability[place], known.mean[place], known.covariance[place], table, AHEAD_S
            )
            key = number[track] - 1, float(states.time_s[place])
            forecasts[key] = mean[:, :2], covariance[:, :2, :2]
    return forecasts


def score(place_m: Floats, covariance_m2: Floats, factors: Floats, truth: Floats) -> Scores:
    """Evaluate a forecast by ellipses of these factors."""
    off = truth - place_m
    square = np.einsum("ki,ki->k", off, np.linalg.solve(covariance_m2, off[..., None])[..., 0])
    area = np.pi * factors * np.sqrt(np.linalg.det(covariance_m2))
    return Scores(np.sum(off**2, axis=1), (square <= factors).astype(float), area)


def joined(parts: list[Scores]) -> Scores:
    """Return many forecasts as one."""
    return Scores(
        np.array([one.squared_m2 for one in parts]),
        np.array([one.held for one in parts]),
        np.array([one.area_m2 for one in parts]),
    )


def report(found: list[Found], methods: Iterable[str]) -> None:
    """Print the table of one traffic."""
    doing = np.concatenate([one.doing for one in found])
    print(f"| | {' | '.join(f'{one:g} s' for one in AHEAD_S)} |\n|{'---|' * (1 + len(AHEAD_S))}")
    for name, kinds in CLASSES.items():
        chosen = np.isin(doing, kinds)
        if not chosen.any() or (name != "all" and chosen.all()):
            continue
        for method in methods:
            each = joined_scenes([getattr(one, method) for one in found])
            error = np.sqrt(np.mean(each.squared_m2[chosen], axis=0))
            held = 100.0 * np.mean(each.held[chosen], axis=0)
            area = np.exp(np.mean(np.log(each.area_m2[chosen]), axis=0)) / 1e6
            cells = [
                f"{m:.0f} m, {h:.1f} %, {a:.3g} km²"
                for m, h, a in zip(error, held, area, strict=True)
            ]
            print(f"| {name}, {METHODS[method]} | {' | '.join(cells)} |")
    spent = 1e3 * np.mean([one.seconds for one in found])
    print(f"\n{len(doing)} forecasts; a forecast takes {spent:.2f} ms\n", flush=True)


def joined_scenes(parts: list[Scores]) -> Scores:
    """Return the forecasts of all scenes."""
    return Scores(
        np.concatenate([one.squared_m2 for one in parts]),
        np.concatenate([one.held for one in parts]),
        np.concatenate([one.area_m2 for one in parts]),
    )


if __name__ == "__main__":
    main()
