"""Prints the table of validation/association.md: the sample and scenarios without identity.

::

    python -m validation.tracker.check_association  # the sample, and the scenarios made for it
    python -m validation.tracker.check_association crossing my.toml  # these scenarios alone

Each row is tracked with the track numbers hidden (of the sample also all but radar plots), first
without codes and addresses, then with codes. Truth comes from the hidden numbers of the sample, and
from `truth.parquet` of a scenario. A track belongs to the aircraft of most of its plots.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "examples" / "vid-sample"
SAMPLE_SENSORS = ROOT / "examples" / "sensors-vid-sample.toml"
SCENES = (
    "crossing", "formation", "shared-code", "code-change", "shared-address", "clutter",
    "u-turn-edge", "primary-only", "garbled-codes", "manoeuvring-traffic",
    "rotating-gaps", "range-gain", "newcomers",
)  # fmt: skip
HIDDEN = {
    "no identity": "track_number,mode_3a,mode_s_address",
    "codes": "track_number,mode_s_address",
}
HEADER = (
    "recording", "known", "plots on the correct track", "of all plots", "swaps", "aircraft",
    "tracks", "initiation, scans", "false tracks", "longest, s", "range bias", "azimuth bias",
)  # fmt: skip
#: Consecutive plots of another aircraft that make a swap; fewer are plots on the wrong track.
SWAP_PLOTS = 3


@dataclass(frozen=True)
class Figures:
    """Figures of merit of a run.

    Attributes
    ----------
    right_share : float
        Fraction of the plots on confirmed tracks that are of the aircraft of their track.
    all_share : float
        Fraction of all plots of aircraft that are on a track of their aircraft, including those
        before its confirmation; outliers and plots in the cone of silence are on none.
    swaps : int
        Number of times that a confirmed track changed to another aircraft.
    aircraft, tracks : int
        Aircraft and confirmed tracks.
    scans : ndarray
        Scans of the radar that detected an aircraft first until its track was confirmed, including
        the first; one value for each aircraft.
    false_tracks : int
        Confirmed tracks without an aircraft, or of one with another confirmed track at the time.
    false_life_s : float
        Duration of the longest of them, s.
    """

    right_share: float
    all_share: float
    swaps: int
    aircraft: int
    tracks: int
    scans: "np.typing.NDArray[np.float64]"
    false_tracks: int
    false_life_s: float


def figures(tracks: pl.DataFrame, truth: pl.DataFrame, period_s: dict[str, float]) -> Figures:
    """Compare updates with the truth.

    Parameters
    ----------
    tracks : DataFrame
        `tracks.parquet`; its own `track_number` is not used.
    truth : DataFrame
        `time_s`, `sensor_id` and `track_number` (null for plots without aircraft) of every plot.
    period_s : dict
        Scan periods of the radars, s.
    """
    keys = ["time_s", "sensor_id"]
    once = truth.select(*keys, "track_number").unique(keys, keep="none")
    rows = tracks.drop("track_number").join(once, on=keys).sort("sequence")
    confirmed = rows.filter(pl.col("state") != "tentative")
    owner = (
        confirmed.group_by("track_id", "track_number").len()
        .sort("len", "track_number", descending=[True, False], nulls_last=True)
        .group_by("track_id", maintain_order=True).first()
        .select("track_id", pl.col("track_number").alias("owner"))
    )  # fmt: skip
    owned = confirmed.join(owner, on="track_id")
    named = owned.filter(pl.col("track_number").is_not_null())
    right = int((named["track_number"] == named["owner"]).fill_null(value=False).sum())
    plots = len(once.drop_nulls("track_number"))
    every = rows.join(owner, on="track_id")
    mine = (every["track_number"] == every["owner"]).fill_null(value=False)
    false, life_s = _false_tracks(owned)
    by_track = named.group_by("track_id")
    return Figures(
        right_share=right / max(len(named), 1),
        all_share=int(mine.sum()) / max(plots, 1),
        swaps=sum(_swaps(part["track_number"].to_numpy()) for _, part in by_track),
        aircraft=once["track_number"].drop_nulls().n_unique(),
        tracks=confirmed["track_id"].n_unique(),
        scans=_scans(named, once, period_s),
        false_tracks=false,
        false_life_s=life_s,
    )


def _swaps(numbers: "np.typing.NDArray[np.int64]") -> int:
    cuts = np.flatnonzero(np.diff(numbers)) + 1
    kept = [part[0] for part in np.split(numbers, cuts) if len(part) >= SWAP_PLOTS]
    return sum(before != after for before, after in pairwise(kept))


def _false_tracks(owned: pl.DataFrame) -> tuple[int, float]:
    lives = owned.group_by("track_id", "owner").agg(
        pl.col("time_s").min().alias("start"), pl.col("time_s").max().alias("end")
    ).sort("owner", pl.col("end") - pl.col("start"), descending=[False, True])  # fmt: skip
    count, longest_s = 0, 0.0
    good: dict[int, list[tuple[float, float]]] = {}
    for _, owner, start, end in lives.iter_rows():
        others = good.setdefault(-1 if owner is None else owner, [])
        if owner is None or any(start < last and first < end for first, last in others):
            count, longest_s = count + 1, max(longest_s, end - start)
        else:
            others.append((start, end))
    return count, longest_s


def _scans(
    named: pl.DataFrame, truth: pl.DataFrame, period_s: dict[str, float]
) -> "np.typing.NDArray[np.float64]":
    radar = truth.filter(pl.col("sensor_id").is_in(list(period_s)))
    first = radar.drop_nulls().sort("time_s").group_by("track_number", maintain_order=True).first()
    known = named.filter(pl.col("track_number") == pl.col("owner"))
    confirmed_at = known.group_by("track_number").agg(pl.col("time_s").min().alias("confirmed_s"))
    both = first.join(confirmed_at, on="track_number")
    periods_s = np.array([period_s[name] for name in both["sensor_id"]])
    return np.asarray((both["confirmed_s"] - both["time_s"]).to_numpy() / periods_s + 1.0)


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="built-in names or files")
    names = parser.parse_args().scenes
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}", flush=True)
    with tempfile.TemporaryDirectory() as made:
        if not names:
            folder = Path(made) / "sample"
            multiradar("convert", "vid", str(SAMPLE), str(folder))
            show("sample", folder, SAMPLE_SENSORS, sample_biases(), kinds=("--kinds", "radar"))
        for name in names or SCENES:
            folder = Path(made) / Path(name).stem
            multiradar("simulate", name, "--out", str(folder))
            show(folder.name, folder, folder / "sensors.toml", scene_biases(folder), kinds=())


def show(
    name: str, folder: Path, sensors: Path, biases: pl.DataFrame, kinds: tuple[str, ...]
) -> None:
    """Track a recording with each kind of identity hidden, and print a row for each."""
    measurements = pl.read_parquet(folder / "measurements.parquet")
    radar = measurements.filter(pl.col("kind") == "radar") if kinds else measurements
    truth_file = folder / "truth.parquet"
    truth = pl.read_parquet(truth_file) if truth_file.exists() else radar
    for known, hidden in HIDDEN.items():
        out = folder / f"tracks-{known.replace(' ', '-')}"
        multiradar(
            "track", str(folder), "--sensors", str(sensors), "--out", str(out),
            "--hide", hidden, *kinds,
        )  # fmt: skip
        found = figures(pl.read_parquet(out / "tracks.parquet"), truth, periods(sensors))
        report = json.loads((out / "report.json").read_text(encoding="utf-8"))
        errors = bias_errors(report["figures"]["final_biases"], biases)
        print(f"| {' | '.join([name, known, *cells(found), *errors])} |", flush=True)


def cells(found: Figures) -> list[str]:
    """Return figures as text."""
    middle, most = np.median(found.scans), np.max(found.scans)
    late = np.percentile(found.scans, 95)
    return [
        f"{found.right_share:.2%}", f"{found.all_share:.2%}", str(found.swaps),
        str(found.aircraft), str(found.tracks),
        f"{middle:.1f} (95 %: {late:.1f}, worst {most:.1f})", str(found.false_tracks),
        f"{found.false_life_s:.0f}",
    ]  # fmt: skip


def periods(sensors: Path) -> dict[str, float]:
    """Return the turns of the radars of a sensors file, as `track` reads it."""
    from multiradar.toolbox.inputs import load_sensor_table

    table = load_sensor_table(sensors)
    return {
        name: float(period)
        for name, period in zip(table.ids, table.rotation_period_s, strict=True)
        if np.isfinite(period)
    }


def sample_biases() -> pl.DataFrame:
    """Return the true biases of the sample."""
    truth = json.loads((SAMPLE / "truth.json").read_text(encoding="utf-8"))
    return pl.DataFrame(
        [
            (f"{one['source']}-{one['sensor']}", parameter, float(one[key]))
            for one in truth["radars"]
            for parameter, key in (
                ("range_offset_m", "bias_range"), ("azimuth_offset_deg", "bias_azimuth_deg")
            )
        ],
        schema=["sensor_id", "parameter", "value"], orient="row",
    )  # fmt: skip


def scene_biases(folder: Path) -> pl.DataFrame:
    """Return the true biases at the end of a scene."""
    biases = pl.read_parquet(folder / "truth_biases.parquet")
    return biases.filter(pl.col("time_s") == pl.col("time_s").max())


def bias_errors(final: dict[str, dict[str, dict[str, float]]], truth: pl.DataFrame) -> list[str]:
    """Return the worst error of the range biases and of the azimuth biases as text."""
    worst = {"range_offset_m": 0.0, "azimuth_offset_deg": 0.0}
    for sensor, parameter, value in truth.select("sensor_id", "parameter", "value").iter_rows():
        known = final.get(sensor, {}).get(parameter)
        if known is not None and parameter in worst:
            worst[parameter] = max(worst[parameter], abs(known["estimate"] - value))
    return [f"{worst['range_offset_m']:.1f} m", f"{worst['azimuth_offset_deg']:.4f}°"]


def multiradar(*command: str) -> None:
    """Run a command."""
    done = subprocess.run(
        [sys.executable, "-m", "multiradar", *command], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise SystemExit(f"multiradar {' '.join(command)}: {done.stderr.strip()}")


if __name__ == "__main__":
    main()
