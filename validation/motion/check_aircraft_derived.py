"""Prints the tables of real-radars.md on aircraft-derived data: turns with and without them.

::

    python -m validation.motion.check_aircraft_derived simulated  # two minutes
    multiradar convert asterix RECORDING.ast --out converted
    python -m validation.motion.check_aircraft_derived recorded RECORDING.ast converted sensors.toml

*Simulated*: the aircraft and radars of check_manoeuvres.py report their motion; each row withholds
part of it, or adds faults: 1 % of registers swapped, and of the aircraft 5 % each whose registers
are not updated from some time on, whose heading is stuck, whose roll has the wrong sign. Cells: RMS
position error and its change, error² / sigma².

*Recorded*: `imm` with and without the data of the recording, beside the tracker of the radar itself
(I048/200). The turns come from the plots alone: a parabola is fitted to those of ± 16 s of each,
and a turn begins where its rate passes half of that of the turn. A turn is detected when the
probability of its side exceeds 0.5; the radar reports no probability, so a second column has the
time at which the heading has changed by 5°. False are detections (consecutive updates are one)
while the aircraft flies straight for 20 s before and after. Errors of headings are those to the
parabolas.
"""

import argparse
import itertools
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.simulation.scenario.reported_data import Atmosphere, RegisterReports
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import Rows, gather
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.layout.columns import Columns
from multiradar_converters.asterix.layout.program import Walked
from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT
from validation.motion.check_manoeuvres import CLASSES, Figure, figures, flights
from validation.tracker.check_recording import tracked

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

METRES_PER_NM = 1852.0
#: Half the window of a fit and plots in it, largest gap between plots, s.
HALF_S, FIT_MIN, GAP_MAX_S = 16.0, 7, 13.0
SLOWEST_MPS = 50.0
#: Rate within a turn, its least change of course, and rate of straight flight, rad/s and rad.
TURN_RATE, TURN_ANGLE, STRAIGHT_RATE = np.radians(0.7), np.radians(20.0), np.radians(0.25)
#: Straight flight around a false detection, search before and after the begin of a turn, s.
STRAIGHT_S, BEFORE_S, AFTER_S = 20.0, 14.0, 60.0
HEADING_CHANGE = np.radians(5.0)
LATE_S = np.inf


#: As in the scenario `aircraft-data`: wind that changes with height and place, 8 K warmer.
AIR = Atmosphere(
    8.0, float(np.radians(250.0)), 0.0025, float(np.radians(0.002)), 3e-5, float(np.radians(3.0)),
    8.0,
)  # fmt: skip
STORM = replace(
    AIR, wind_speed_mps=25.0, wind_gradient_per_s=6e-5,
    magnetic_variation_rad=float(np.radians(-15.0)), temperature_offset_k=-15.0,
)  # fmt: skip
BOTH = RegisterReports(("5,0", "6,0"))
ONLY_AIR = RegisterReports(("6,0",))
FAULTY = RegisterReports(
    ("5,0", "6,0"), swap_probability=0.01, stale_share=0.05, sign_share=0.05, stuck_share=0.05
)
SCENARIOS: dict[str, tuple[RegisterReports | None, Atmosphere]] = {
    "nothing": (None, AIR),
    "registers 5,0 and 6,0": (BOTH, AIR),
    "register 5,0": (RegisterReports(("5,0",)), AIR),
    "register 6,0": (ONLY_AIR, AIR),
    "register 6,0, stronger wind, variation −15°": (ONLY_AIR, STORM),
    "5,0 and 6,0, each in a quarter of the plots": (replace(BOTH, probability=0.25), AIR),
    "5,0 and 6,0, with faults": (FAULTY, AIR),
    "5,0 and 6,0, with faults, unchecked": (replace(FAULTY, checks=False), AIR),
    "register 6,0, with faults": (replace(FAULTY, registers=("6,0",)), AIR),
}


@dataclass(frozen=True)
class Turn:
    """A turn of an aircraft: its begin and end, s, and whether it is to the right."""

    begin_s: float
    end_s: float
    right: bool


@dataclass(frozen=True)
class Flight:
    """What the plots of an aircraft show, without a gap: times, course, and its rate."""

    address: str
    time_s: Floats
    course: Floats
    rate: Floats

    def turns(self) -> Iterator[Turn]:
        """Yield the turns that follow straight flight."""
        turning = np.abs(self.rate) > TURN_RATE
        side = np.where(turning, np.sign(self.rate), 0.0)
        cuts = np.r_[0, np.flatnonzero(np.diff(side)) + 1, len(side)]
        for first, last in itertools.pairwise(cuts):
            angle = abs(np.trapezoid(self.rate[first:last], self.time_s[first:last]))
            if not turning[first] or angle < TURN_ANGLE or first == 0:
                continue
            half = 0.5 * float(np.median(np.abs(self.rate[first:last])))
            at = first
            while at > 0 and side[first] * self.rate[at] > half:
                at -= 1
            low, high = side[first] * self.rate[at], side[first] * self.rate[at + 1]
            share = np.clip((half - low) / max(high - low, 1e-9), 0.0, 1.0)
            begin_s = self.time_s[at] + share * (self.time_s[at + 1] - self.time_s[at])
            before = (self.time_s > begin_s - 40.0) & (self.time_s < begin_s - HALF_S)
            if before.sum() >= 4 and np.abs(self.rate[before]).max() < STRAIGHT_RATE * 2.0:
                yield Turn(float(begin_s), float(self.time_s[last - 1]), bool(side[first] > 0))


@dataclass(frozen=True)
class Estimates:
    """Estimates of one aircraft by one tracker; without probabilities they are NaN."""

    time_s: Floats
    heading: Floats
    right: Floats
    left: Floats


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    simulated = parts.add_parser("simulated")
    simulated.add_argument("--runs", type=int, default=4, help="seeds")
    recorded = parts.add_parser("recorded")
    recorded.add_argument("recording", type=Path, help="category 048")
    recorded.add_argument("converted", type=Path, help="output folder of `convert`")
    recorded.add_argument("sensors", type=Path, help="sensors file")
    options = parser.parse_args()
    if options.part == "simulated":
        print_simulated(options.runs)
    else:
        print_recorded(options.recording, options.converted, options.sensors)


def print_simulated(runs: int) -> None:
    """Print the table of simulated flights."""
    print(f"| reported | {' | '.join(CLASSES)} |\n|{'---|' * (1 + len(CLASSES))}")
    against: dict[str, Figure] = {}
    for name, (registers, air) in SCENARIOS.items():
        flown = flights(
            runs, aircraft=30, duration_s=1500.0, known=True, registers=registers, air=air
        )
        found = figures(TrackingSettings(), flown)
        against = against or found
        row = [
            f"{found[one].rms_m:.1f} m ({found[one].rms_m / against[one].rms_m - 1.0:+.0%}), "
            f"{found[one].nees:.2f}"
            for one in CLASSES
        ]
        print(f"| {name} | {' | '.join(row)} |", flush=True)


def print_recorded(recording: Path, converted: Path, sensors: Path) -> None:
    """Print the table of a recording."""
    measured = pl.read_parquet(converted / "measurements.parquet")
    found = list(flights_of(measured))
    turns = [(one, turn) for one in found for turn in one.turns()]
    straight_h = straight_hours(found)
    print(
        f"{len(found)} flights of {len({one.address for one in found})} aircraft, "
        f"{len(turns)} turns, {straight_h:.1f} h straight\n"
    )
    print(
        "| tracker | turns detected | delay: median, 90 % | earlier than without: median | false "
        "per hour | heading 5° changed after: median | heading error: straight, in turns |"
    )
    print(f"|{'---|' * 7}")
    with tempfile.TemporaryDirectory() as made:
        trackers = {
            "`imm` without the data": estimates(converted, sensors, Path(made), withheld=True),
            "`imm`": estimates(converted, sensors, Path(made), withheld=False),
            "the radar's own": of_radar(recording, measured),
        }
    first: Floats | None = None
    for name, each in trackers.items():
        delays = np.array([delay(each.get(one.address), turn) for one, turn in turns])
        first = delays if first is None else first
        print(f"| {name} | {' | '.join(cells(each, found, turns, delays, first))} |")


def cells(
    each: dict[str, Estimates], found: list[Flight], turns: list[tuple[Flight, Turn]],
    delays: Floats, first: Floats,
) -> tuple[str, ...]:  # fmt: skip
    """Return the cells of a tracker."""
    changed = np.array([heading_delay(each.get(one.address), turn) for one, turn in turns])
    shares = [errors(each.get(one.address), one) for one in found]
    error = np.concatenate([one[0] for one in shares])
    turning = np.concatenate([one[1] for one in shares])
    level = np.concatenate([one[2] for one in shares])
    of_heading = (
        f"{np.median(changed):.1f} s",
        f"{rms(error[level]):.2f}°, {rms(error[turning]):.1f}°",
    )
    if np.isinf(delays).all():
        return ("–", "–", "–", "–", *of_heading)
    both = np.isfinite(delays) & np.isfinite(first)
    false = sum(false_detections(each.get(one.address), one) for one in found)
    return (
        f"{np.isfinite(delays).sum()} of {len(delays)}",
        f"{np.median(delays):.1f}, {np.quantile(delays, 0.9, method='lower'):.1f} s",
        f"{np.median((first - delays)[both]):.1f} s",
        f"{false / straight_hours(found):.2f} ({false})",
        *of_heading,
    )


def rms(error: Floats) -> float:
    """Return the root mean square in degrees."""
    return float(np.degrees(np.sqrt(np.mean(error**2))))


def flights_of(measured: pl.DataFrame) -> Iterator[Flight]:
    """Yield the parts without gaps of the airborne plots of each aircraft."""
    plots = measured.filter(
        pl.col("mode_s_address").is_not_null()
        & pl.col("height_m").is_not_null()
        & ~pl.col("on_ground").fill_null(value=False)
    ).sort("time_s")
    for (address,), own in plots.group_by("mode_s_address", maintain_order=True):
        time_s, range_m = own["time_s"].to_numpy(), own["range_m"].to_numpy()
        azimuth = np.radians(own["azimuth_deg"].to_numpy())
        ground_m = np.sqrt(np.maximum(range_m**2 - own["height_m"].to_numpy() ** 2, 0.0))
        east, north = ground_m * np.sin(azimuth), ground_m * np.cos(azimuth)
        cuts = np.r_[0, np.flatnonzero(np.diff(time_s) > GAP_MAX_S) + 1, len(time_s)]
        for begin, end in itertools.pairwise(cuts):
            if end - begin > 2 * FIT_MIN:
                yield from fitted(
                    str(address), time_s[begin:end], east[begin:end], north[begin:end]
                )


def fitted(address: str, time_s: Floats, east: Floats, north: Floats) -> Iterator[Flight]:
    """Yield the course and its rate at each plot by parabolas, where the aircraft flies."""
    rows = []
    for at in time_s:
        near = np.abs(time_s - at) <= HALF_S
        centred = near.sum() >= FIT_MIN and abs(np.mean(time_s[near] - at)) < 0.25 * HALF_S
        if not centred:
            continue
        design = np.vander(time_s[near] - at, 3)
        (bend_e, v_e, _), (bend_n, v_n, _) = (
            np.linalg.lstsq(design, one[near], rcond=None)[0] for one in (east, north)
        )
        squared = v_e**2 + v_n**2
        if squared > SLOWEST_MPS**2:
            rate = 2.0 * (bend_e * v_n - bend_n * v_e) / squared
            rows.append((at, np.arctan2(v_e, v_n), rate))
    if len(rows) > FIT_MIN:
        table = np.array(rows)
        yield Flight(address, table[:, 0], table[:, 1], table[:, 2])


def straight(one: Flight) -> Flags:
    """Return which plots have straight flight before and after them."""
    bent = np.abs(one.rate) > STRAIGHT_RATE
    near = np.abs(one.time_s[:, None] - one.time_s[None]) <= STRAIGHT_S
    return np.asarray(~(near & bent[None]).any(axis=1))


def straight_hours(found: list[Flight]) -> float:
    """Return the hours of straight flight."""
    return float(sum(np.gradient(one.time_s)[straight(one)].sum() for one in found)) / 3600.0


def estimates(
    converted: Path, sensors: Path, made: Path, *, withheld: bool
) -> dict[str, Estimates]:
    """Return what `track` estimates with the data, or with them withheld."""
    folder, out = made / f"input-{withheld}", made / f"tracks-{withheld}"
    folder.mkdir()
    table = pl.read_parquet(converted / "measurements.parquet")
    if withheld:
        table = table.with_columns(
            pl.lit(None, dtype=table.schema[name]).alias(name) for name in MEASUREMENT_AIRCRAFT
        )
    table.write_parquet(folder / "measurements.parquet")
    tracked(folder, sensors, "imm", out)
    return by_aircraft(pl.read_parquet(out / "tracks.parquet"))


def by_aircraft(tracks: pl.DataFrame) -> dict[str, Estimates]:
    """Return the estimates of each address."""
    table = tracks.filter(pl.col("mode_s_address").is_not_null()).sort("time_s")
    return {
        str(address): Estimates(
            own["time_s"].to_numpy(),
            np.radians(own["heading_deg"].cast(pl.Float64).fill_null(np.nan).to_numpy()),
            own["turn_right_probability"].cast(pl.Float64).fill_null(0.0).to_numpy(),
            own["turn_left_probability"].cast(pl.Float64).fill_null(0.0).to_numpy(),
        )
        for (address,), own in table.group_by("mode_s_address", maintain_order=True)
    }


def of_radar(recording: Path, measured: pl.DataFrame) -> dict[str, Estimates]:
    """Return the headings of the radar's own tracker, item 200 of category 048."""
    blocks = read_blocks(recording)
    parts: list[pl.DataFrame] = []

    def read(walked: Walked, _rows: Rows) -> None:
        columns = Columns(walked, blocks.data)
        if walked.program.layout.category == 48 and columns.has("200"):
            parts.append(
                pl.DataFrame(
                    {
                        "of_day_s": columns.numbers("140"),
                        "address": columns.integers("220"),
                        "heading_deg": columns.numbers("200", "HDG"),
                    }
                )
            )

    gather(blocks, Editions(), watch=read)
    table = pl.concat(parts).filter(pl.col("heading_deg").is_not_nan(), pl.col("address") >= 0)
    # Times of the measurements may be dated.
    day_s = np.floor(measured["time_s"].to_numpy().min() / 86_400.0) * 86_400.0
    return by_aircraft(
        table.select(
            time_s=pl.col("of_day_s") + day_s,
            mode_s_address=pl.col("address").map_elements(
                lambda address: f"{address:06x}", return_dtype=pl.String
            ),
            heading_deg=pl.col("heading_deg"),
            turn_right_probability=pl.lit(0.0),
            turn_left_probability=pl.lit(0.0),
        )
    )


def delay(each: Estimates | None, turn: Turn) -> float:
    """Return the time from the begin of a turn to its detection."""
    if each is None:
        return LATE_S
    flagged = (each.right if turn.right else each.left) > 0.5
    end_s = min(turn.begin_s + AFTER_S, turn.end_s + BEFORE_S)
    own = flagged & (each.time_s > turn.begin_s - BEFORE_S) & (each.time_s < end_s)
    return float(each.time_s[own][0] - turn.begin_s) if own.any() else LATE_S


def heading_delay(each: Estimates | None, turn: Turn) -> float:
    """Return the time from the begin of a turn until the heading has followed it by 5°."""
    if each is None:
        return LATE_S
    before = (each.time_s > turn.begin_s - 40.0) & (each.time_s < turn.begin_s - BEFORE_S)
    after = (each.time_s > turn.begin_s - BEFORE_S) & (each.time_s < turn.begin_s + AFTER_S)
    if not before.any():
        return LATE_S
    middle = np.angle(np.mean(np.exp(1j * each.heading[before])))
    change = np.angle(np.exp(1j * (each.heading - middle))) * (1.0 if turn.right else -1.0)
    own = after & (change > HEADING_CHANGE)
    return float(each.time_s[own][0] - turn.begin_s) if own.any() else LATE_S


def false_detections(each: Estimates | None, one: Flight) -> int:
    """Return how often turns are detected in straight flight."""
    if each is None:
        return 0
    level = one.time_s[straight(one)]
    at = np.searchsorted(each.time_s, level - 0.01)
    at = at[at < len(each.time_s)]
    flagged = np.maximum(each.right, each.left)[at] > 0.5
    return int(np.sum(flagged & ~np.r_[False, flagged[:-1]]))


def errors(each: Estimates | None, one: Flight) -> tuple[Floats, Flags, Flags]:
    """Return the errors of headings at the plots, and which are in turns and in straight flight."""
    if each is None:
        return np.empty(0), np.empty(0, np.bool_), np.empty(0, np.bool_)
    at = np.minimum(np.searchsorted(each.time_s, one.time_s - 0.01), len(each.time_s) - 1)
    found = (np.abs(each.time_s[at] - one.time_s) < 0.01) & ~np.isnan(each.heading[at])
    error = np.angle(np.exp(1j * (each.heading[at] - one.course)))[found]
    return error, (np.abs(one.rate) > TURN_RATE)[found], straight(one)[found]


if __name__ == "__main__":
    main()
