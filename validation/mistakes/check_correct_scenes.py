"""Simulates and tracks random correct scenarios, and prints their diagnoses, all of them false.

::

    python -m validation.mistakes.check_correct_scenes --count 150
    python -m validation.mistakes.check_correct_scenes --first 200 --count 10 --align

Radars of all kinds (Mode S, Mode A/C, primary; scans of 1 to 12 s; any noise, biases and clutter)
and ADS-B or multilateration see airliners, light aircraft, or fighters in training. Exit status 1
if a scenario has a diagnosis.
"""

import argparse
import contextlib
import io
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import multiradar as mr
from multiradar.cli.main import run
from multiradar.errors import FindingsError

#: Spans of the traffic of each kind.
_AIRLINERS: dict[str, Any] = {"height_m": [7000, 12_000], "speed_mps": [180, 270]}
_CLIMBING: dict[str, Any] = {
    "height_m": [3000, 11_000], "speed_mps": [120, 240], "leg_s": [60, 240],
    "turn_rate_deg_per_s": [0.5, 2], "climb_mps": [-12, 12],
}  # fmt: skip
_LIGHT: dict[str, Any] = {
    "height_m": [400, 3000], "speed_mps": [35, 90], "leg_s": [30, 200],
    "turn_rate_deg_per_s": [0.5, 4], "climb_mps": [-4, 4],
}  # fmt: skip
_FIGHTERS: dict[str, Any] = {
    "height_m": [1500, 12_000], "speed_mps": [170, 350], "leg_s": [15, 90],
    "turn_rate_deg_per_s": [1, 8], "acceleration_mps2": [-4, 4], "climb_mps": [-60, 60],
}  # fmt: skip
_AEROBATICS: dict[str, Any] = {
    "height_m": [1500, 9000], "speed_mps": [150, 300], "leg_s": [10, 40],
    "turn_rate_deg_per_s": [3, 9], "acceleration_mps2": [-5, 5], "climb_mps": [-40, 40],
}  # fmt: skip
_TRAFFIC = (
    (_AIRLINERS,), (_AIRLINERS,), (_AIRLINERS, _LIGHT, _CLIMBING), (_LIGHT,),
    (_FIGHTERS, _AIRLINERS), (_FIGHTERS, _AIRLINERS), (_AEROBATICS,),
)  # fmt: skip
_PERIODS_S = (1.0, 2.0, 4.0, 4.8, 4.9, 5.0, 6.0, 8.0, 10.0, 12.0)
#: Usual words of `align` about recordings of few aircraft.
_NO_DIAGNOSIS = ("aircraft in common", "no aircraft has plots", "biases remain at their priors")


class Draw:
    """Random numbers of a scenario."""

    def __init__(self, seed: int) -> None:
        self._generator = np.random.Generator(np.random.PCG64(seed))

    def between(self, low: float, high: float, digits: int = 0) -> float:
        """Return a number, rounded."""
        return round(float(self._generator.uniform(low, high)), digits)

    def spread(self, low: float, high: float, digits: int = 0) -> float:
        """Return a number of any magnitude, rounded."""
        return round(float(np.exp(self._generator.uniform(np.log(low), np.log(high)))), digits)

    def one_of(self, *values: Any) -> Any:
        """Return one of some values."""
        return values[int(self._generator.integers(len(values)))]

    def happens(self, probability: float) -> bool:
        """Return whether something happens."""
        return bool(self._generator.uniform() < probability)


def scenario(seed: int) -> dict[str, Any]:
    """Return a random correct scenario, as `multiradar simulate` reads it."""
    draw = Draw(seed)
    around_m, apart_m = draw.one_of(80e3, 150e3, 250e3), draw.between(20e3, 220e3)
    duration_s = draw.between(300, 1500)
    anonymous, heard = draw.happens(0.25), draw.one_of(1.0, 1.0, 1.0, 0.7)
    traffic = []
    for kind in draw.one_of(*_TRAFFIC):
        one = {
            **kind, "count": draw.one_of(*range(8, 36)), "heard_height_share": heard,
            "east_m": [-around_m, around_m], "north_m": [-around_m, around_m],
            "height_step_m": draw.one_of(7.62, 7.62, 30.48),
        }  # fmt: skip
        if draw.happens(0.4):
            one |= {"start_s": [0, 0.6 * duration_s], "life_s": [200, duration_s]}
        if draw.happens(0.6):
            one["equipped_share"] = draw.between(0.2, 1.0, 2)
        traffic.append(one)
    period_s = draw.one_of(None, None, None, 4.0, 10.0)
    sensors = [
        _radar(draw, number, period_s, around_m, apart_m, anonymous=anonymous)
        for number in range(draw.one_of(1, 2, 3, 4, 5))
    ]
    for kind, share, sigma_m in (("adsb", 0.5, 60.0), ("mlat", 0.2, 80.0)):
        if draw.happens(share):
            sensors.append({
                "id": kind, "kind": kind, "interval_s": draw.one_of(0.5, 1, 2, 4, 5),
                "position_sigma_m": draw.between(5.0, sigma_m, 1),
                "detection_probability": draw.between(0.5, 1.0, 2),
            })  # fmt: skip
    return {
        "seed": seed,
        "duration_s": duration_s,
        "start_time_s": 1.7856e9 + draw.between(0.0, 1e6),
        "plane": {
            "latitude_deg": draw.between(-45.0, 65.0, 3),
            "longitude_deg": draw.between(-170.0, 170.0, 3),
        },
        "traffic": traffic,
        "sensor": sensors,
    }


def _radar(
    draw: Draw, number: int, period_s: float | None, around_m: float, apart_m: float,
    *, anonymous: bool,
) -> dict[str, Any]:  # fmt: skip
    one: dict[str, Any] = {
        "id": f"radar-{number + 1}",
        "east_m": draw.between(-apart_m, apart_m),
        "north_m": draw.between(-apart_m, apart_m),
        "height_m": draw.between(5, 900),
        "rotation_period_s": period_s or draw.one_of(*_PERIODS_S),
        "range_sigma_m": draw.spread(12.0, 150.0, 1),
        "azimuth_sigma_deg": draw.spread(0.02, 0.2, 3),
        "range_max_m": draw.between(0.8, 2.5, 2) * around_m,
        "detection_probability": draw.between(0.75, 0.99, 2),
        "bias": {
            "range_offset_m": draw.between(-250, 250),
            "azimuth_offset_deg": draw.between(-0.4, 0.4, 3),
        },
    }
    kind = "primary" if anonymous else draw.one_of("s", "s", "s", "ac", "ac", "primary")
    if kind != "s":
        one["reports"] = ["height", "mode_3a"] if kind == "ac" else draw.one_of([], ["height"])
    usual = (
        ("clutter_per_turn", 0.35, draw.spread(0.3, 60.0, 1)),
        ("outlier_probability", 0.4, draw.between(0.0005, 0.01, 4)),
        ("height_probability", 0.3, draw.between(0.8, 1.0, 2)),
        ("garbled_height_probability", 0.3, draw.between(0.0, 0.01, 4)),
        ("elevation_max_deg", 0.5, 45.0),
    )
    return one | {key: value for key, share, value in usual if draw.happens(share)}


def found_in(seed: int, *, align: bool) -> list[str] | None:
    """Return the diagnoses of a scenario; None where a radar detects no aircraft."""
    with tempfile.TemporaryDirectory(prefix="multiradar-scene-") as name:
        folder = Path(name)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                scene = mr.simulate(scenario(seed), out=folder / "scene")
            except FindingsError:
                return None
            found: list[str] = []
            sensors = scene.folder / "sensors.toml"
            try:
                mr.track(scene.folder, sensors, out=folder / "tracks")
            except FindingsError as error:
                found.append(str(error))
        found += [str(one.message) for one in said]
        if align:
            error_text = io.StringIO()
            command = ["align", str(scene.folder), "--sensors", str(sensors)]
            with contextlib.redirect_stderr(error_text), contextlib.redirect_stdout(io.StringIO()):
                run(command)
            lines = error_text.getvalue().splitlines()
            found += [one for one in lines if not any(usual in one for usual in _NO_DIAGNOSIS)]
    return found


def main() -> None:
    """Simulate and track the scenarios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="First seed.")
    parser.add_argument("--count", type=int, default=150, metavar="N", help="Scenarios.")
    parser.add_argument("--align", action="store_true", help="Register the radars, too.")
    given = parser.parse_args()
    tracked = wrong = 0
    for seed in range(given.first, given.first + given.count):
        found = found_in(seed, align=given.align)
        tracked += found is not None
        wrong += bool(found)
        for sentence in found or ():
            print(f"{seed}: {sentence}", flush=True)
    print(f"{wrong} of {tracked} correct scenarios have a diagnosis")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
