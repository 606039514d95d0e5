"""Prints the table of forecasts of docs/restoration.md: by bundle, filter's modes, polynomial.

::

    python docs/check_bundle_forecasts.py              # three seeds of two traffics, some minutes
    python docs/check_bundle_forecasts.py --straight 300 --first-seed 40 --runs 1

Aircraft fly as in check_restoration.py, banks of at most 22°: legs between whose manoeuvres lie two
minutes on average, and legs without any. Ten seconds after ten seconds each aircraft is forecast
10 to 300 s ahead, by its bundle (`restoration.forecast`), by the modes of `imm`
(`tracking.forecast`) and by a polynomial (`tracking.polynomial_forecast`), from the same plots, and
compared with where it is then. Settings were chosen on seeds 20 and 21; the table is of others.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np
from check_manoeuvres import CLASSES, Flown, doing_at, flights
from check_smoothers import in_place
from numpy.typing import NDArray

from multiradar.restoration.bundle import Bundle
from multiradar.restoration.fan import REGION_MEMBERS, Fan
from multiradar.restoration.forecast import forecast
from multiradar.restoration.forecast_settings import ForecastSettings
from multiradar.restoration.settings import BundleSettings
from multiradar.runtime.engine import Engine
from multiradar.simulation.paths import fly
from multiradar.tracking.forecast import forecast_modes_of, forecast_of_modes
from multiradar.tracking.polynomial_forecast import polynomial_forecast
from multiradar.tracking.regions import gaussian_factor, region_factors
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: By aircraft and time of its last plot: places and covariances at all times ahead.
Said = dict[tuple[int, float], tuple[Floats, Floats]]

AHEAD_S = np.array([10.0, 30.0, 60.0, 120.0, 300.0])
PROBABILITY = 0.95
RUN_S = 600.0
GRID_S = np.arange(65.0, RUN_S, 10.0)
#: No legs between manoeuvres end within the scene.
NEVER_S = 1e6


@dataclass(frozen=True)
class Judged:
    """Forecasts by one method: squared errors, whether the region held, its area (n, times)."""

    squared_m2: Floats
    held: Floats
    area_m2: Floats


@dataclass(frozen=True)
class Found:
    """All methods over one scene, what each aircraft did, and the time for a fan, s."""

    bundle: Judged
    imm: Judged
    polynomial: Judged
    doing: Integers
    seconds: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="seeds")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--aircraft", type=int, default=12, help="in each run")
    parser.add_argument("--straight", type=float, nargs="+", default=[120.0, NEVER_S],
                        help="mean straight leg, s")  # fmt: skip
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.runs)
    for straight_s in options.straight:
        found = []
        for seed in seeds:
            (flown,) = flights(
                1, aircraft=options.aircraft, duration_s=RUN_S + AHEAD_S[-1], known=True,
                straight_s=straight_s, first_seed=seed, bank_max_deg=22.0,
            )  # fmt: skip
            found.append(compare(flown))
        print(f"**a manoeuvre after {straight_s:g} s of straight flight on average**\n")
        report(found)


def compare(flown: Flown) -> Found:
    """Forecast all aircraft of a scene by all methods."""
    # Legs are flown without random numbers.
    paths = [
        fly(one, RUN_S + AHEAD_S[-1], np.random.Generator(np.random.PCG64(0)))
        for one in flown.fliers
    ]
    said_by_imm = by_modes(flown)
    bundles, modes, polynomials, doing, spent = [], [], [], [], []
    sightings = in_place(flown).sightings
    for key, bundle in bundles_of(flown, said_by_imm):
        began = process_time()
        fan = forecast(bundle.ends(), AHEAD_S, ForecastSettings(), bundle.habits)
        spent.append(process_time() - began)
        truth = paths[key[0]].place(fan.time_s + AHEAD_S)
        factors = np.full(len(AHEAD_S), gaussian_factor(PROBABILITY))
        bundles.append(judged_fan(fan, truth))
        modes.append(judge(*said_by_imm[key], factors, truth))
        mine = (sightings.aircraft == key[0]) & (sightings.time_s <= fan.time_s)
        polynomial = polynomial_forecast(
            sightings.time_s[mine], sightings.position_m[mine], sightings.covariance_m2[mine],
            fan.time_s + AHEAD_S,
        )  # fmt: skip
        polynomials.append(judge(*polynomial, factors, truth))
        doing.append(doing_at(flown.fliers[key[0]], fan.time_s))
    doings, seconds = np.array(doing), float(np.median(spent))
    return Found(joined(bundles), joined(modes), joined(polynomials), doings, seconds)


def bundles_of(flown: Flown, wanted: Said) -> Iterator[tuple[tuple[int, float], Bundle]]:
    """Follow each aircraft; yield its bundle after the plots that are asked for."""
    sightings = in_place(flown).sightings
    for aircraft in np.unique(sightings.aircraft).tolist():
        rows = np.flatnonzero((sightings.aircraft == aircraft) & (sightings.time_s < RUN_S))
        bundle = Bundle(BundleSettings())
        for row in rows:
            time_s = float(sightings.time_s[row])
            bundle.take(time_s, sightings.position_m[row], sightings.covariance_m2[row])
            key = aircraft, time_s
            if key in wanted and len(bundle):
                yield key, bundle


def by_modes(flown: Flown) -> Said:
    """Return what the modes of `imm` say, from the last plots before the same times."""
    settings = TrackingSettings(filter_name="imm")
    engine, table = Engine(flown.sensors, settings), forecast_modes_of(settings)
    number: dict[int, int] = {}
    said: Said = {}
    before = 0
    for cut in np.searchsorted(flown.batch.time_s, GRID_S).tolist():
        updates = engine.push(flown.batch.take(slice(before, cut))).updates
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
            said[key] = mean[:, :2], covariance[:, :2, :2]
    return said


def judged_fan(fan: Fan, truth: Floats) -> Judged:
    """Judge a fan by the ellipse that holds its probability."""
    members = fan.heaviest(REGION_MEMBERS)
    factors = region_factors(
        members.weight, members.state[..., :2], members.covariance[..., :2, :2], PROBABILITY
    )
    return judge(fan.mean()[:, :2], fan.spread()[:, :2, :2], factors, truth)


def judge(place_m: Floats, covariance_m2: Floats, factors: Floats, truth: Floats) -> Judged:
    """Judge a forecast by ellipses of these factors."""
    off = truth - place_m
    square = np.einsum("ki,ki->k", off, np.linalg.solve(covariance_m2, off[..., None])[..., 0])
    area = np.pi * factors * np.sqrt(np.linalg.det(covariance_m2))
    return Judged(np.sum(off**2, axis=1), (square <= factors).astype(float), area)


def joined(parts: list[Judged]) -> Judged:
    """Return many forecasts as one."""
    return Judged(
        np.array([one.squared_m2 for one in parts]),
        np.array([one.held for one in parts]),
        np.array([one.area_m2 for one in parts]),
    )


def report(found: list[Found]) -> None:
    """Print the table of one traffic."""
    doing = np.concatenate([one.doing for one in found])
    print(f"| | {' | '.join(f'{one:g} s' for one in AHEAD_S)} |\n|{'---|' * (1 + len(AHEAD_S))}")
    for name, kinds in CLASSES.items():
        chosen = np.isin(doing, kinds)
        if not chosen.any() or (name != "all" and chosen.all()):
            continue
        for method in ("bundle", "imm", "polynomial"):
            each = joined_scenes([getattr(one, method) for one in found])
            error = np.sqrt(np.mean(each.squared_m2[chosen], axis=0))
            held = 100.0 * np.mean(each.held[chosen], axis=0)
            area = np.exp(np.mean(np.log(each.area_m2[chosen]), axis=0)) / 1e6
            cells = [
                f"{m:.0f} m, {h:.1f} %, {a:.3g} km²"
                for m, h, a in zip(error, held, area, strict=True)
            ]
            print(f"| {name}, {method} | {' | '.join(cells)} |")
    spent = 1e3 * np.mean([one.seconds for one in found])
    print(f"\n{len(doing)} forecasts; a fan takes {spent:.2f} ms\n", flush=True)


def joined_scenes(parts: list[Judged]) -> Judged:
    """Return the forecasts of all scenes."""
    return Judged(
        np.concatenate([one.squared_m2 for one in parts]),
        np.concatenate([one.held for one in parts]),
        np.concatenate([one.area_m2 for one in parts]),
    )


if __name__ == "__main__":
    main()
