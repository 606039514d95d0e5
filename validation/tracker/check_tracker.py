"""Prints all figures of merit of the tracker with their limits, for docs/validation/tracker.md.

::

    python -m validation.tracker.check_tracker  # five to ten minutes
    python -m validation.tracker.check_tracker --write  # and put them into validation/tracker.md
    # quick: one seed of the manoeuvres instead of eight
    python -m validation.tracker.check_tracker --runs 1

The sample recording is tracked from radar plots alone, by `two-stage` and by `imm`, without
identity, with codes, and with its track numbers; the reference is ADS-B and the hidden track
numbers. Then manoeuvring aircraft are simulated, with known and with estimated biases. All measures
are those of check_association.py, check_manoeuvres.py and `multiradar evaluate`.
"""

import argparse
import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from multiradar.evaluation.card.figures import figures_of
from multiradar.evaluation.scorecard import evaluate
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.toolbox.evaluation.inputs import read_reports
from multiradar.toolbox.evaluation.known import Known
from multiradar.toolbox.evaluation.tracked import read_biases, read_tracks
from multiradar.tracking.settings import TrackingSettings
from validation.documents.marked_parts import put
from validation.motion import check_manoeuvres as manoeuvres
from validation.tracker import check_association as association

DOCS = Path(__file__).parents[2] / "docs"
FILTERS = ("two-stage", "imm")
NUMBERED = "track numbers"
#: Presets to be met, and the settling time for the second set of errors, s.
PRESETS = ("ed142-tma", "esassp-3nm")
SETTLED_S = 60.0
#: Limits: swaps per hour without codes; fraction of plots; scans; life of a false track, s; errors.
SWAPS_PER_H, RIGHT_SHARE, SCANS, FALSE_S, MEDIAN_M, RMS_M = 1.0, 0.99, 3.0, 30.0, 36.0, 60.0
#: Required reduction of errors against the best constant process noise.
BELOW = {"turns": 0.40, "straights": 0.20}
#: Scenarios of manoeuvres: traffic begins within ± m, mean straight leg, s.
SCENES = ((150e3, 120.0), (100e3, 200.0))


@dataclass(frozen=True)
class Run:
    """Results of one run over the sample."""

    title: str
    identity: bool
    found: association.Figures
    card: dict[str, Any]
    settled: dict[str, Any]
    biases: list[tuple[float, float]]
    hours: float


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=8, help="seeds of the manoeuvres")
    parser.add_argument("--write", action="store_true", help="put them into validation/tracker.md")
    parser.add_argument("--docs", type=Path, help="put them into the tracker.md of this folder")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        runs = list(sample_runs(Path(made)))
    parts = {"sample": sample_table(runs)}
    print(parts["sample"], flush=True)
    parts["manoeuvres"] = "\n\n".join(manoeuvre_tables(options.runs))
    docs = DOCS if options.write else options.docs
    if docs is not None:
        for name, text in parts.items():
            put(docs / "validation" / "tracker.md", name, text)


def sample_runs(folder: Path) -> Iterator[Run]:
    """Track the sample with each filter and each part of identity."""
    recording = folder / "sample"
    association.multiradar("convert", "vid", str(association.SAMPLE), str(recording))
    measurements = pl.read_parquet(recording / "measurements.parquet").filter(kind="radar")
    reports = read_reports(recording, EvaluationSettings())
    periods = association.periods(association.SAMPLE_SENSORS)
    hours = float(np.ptp(measurements["time_s"].to_numpy())) / 3600.0
    for name in FILTERS:
        for known, hidden in (*association.HIDDEN.items(), (NUMBERED, "")):
            out = folder / f"{name}-{known.replace(' ', '-')}"
            association.multiradar(
                "track", str(recording), "--sensors", str(association.SAMPLE_SENSORS),
                "--kinds", "radar", "--filter", name, "--out", str(out),
                *(("--hide", hidden) if hidden else ()),
            )  # fmt: skip
            yield Run(
                title=f"`{name}`, {known}",
                identity=not hidden,
                found=association.figures(
                    pl.read_parquet(out / "tracks.parquet"), measurements, periods
                ),
                card=evaluated(out, reports, EvaluationSettings()),
                settled=evaluated(out, reports, EvaluationSettings(settling_s=SETTLED_S)),
                biases=bias_errors(out),
                hours=hours,
            )


def evaluated(tracks: Path, reports: Known, settings: EvaluationSettings) -> dict[str, Any]:
    """Return the figures of `multiradar evaluate`."""
    card = evaluate(
        read_tracks(tracks, reports, settings), reports.reference, settings, PRESETS,
        plots=reports.plots, biases=read_biases(tracks, reports),
    )  # fmt: skip
    return dict(figures_of(card))


def bias_errors(out: Path) -> list[tuple[float, float]]:
    """Return the worst error of the biases of range, m, and azimuth, °, each with error / sigma."""
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    final = report["figures"]["final_biases"]
    worst: dict[str, tuple[float, float]] = {}
    for sensor, parameter, value in association.sample_biases().iter_rows():
        estimated = final[sensor][parameter]
        error = abs(estimated["estimate"] - value)
        most, ratio = worst.get(parameter, (0.0, 0.0))
        worst[parameter] = max(most, error), max(ratio, error / estimated["sigma"])
    return [worst["range_offset_m"], worst["azimuth_offset_deg"]]


def sample_table(runs: list[Run]) -> str:
    """Return the table of the sample: a column for each run, its limit beside each figure."""
    rows = [("", "limit", *(run.title for run in runs))]
    columns = [list(cells(run)) for run in runs]
    for line in zip(*columns, strict=True):
        name, limit = line[0][:2]
        rows.append((name, limit, *(text for _, _, text in line)))
    head, *rest = (f"| {' | '.join(one)} |" for one in rows)
    return "\n".join([head, "|---" * (len(runs) + 2) + "|", *rest])


def cells(run: Run) -> Iterator[tuple[str, str, str]]:
    """Yield name, limit and value of each figure of a run; values outside their limit are bold."""
    found = run.found
    coded = "no identity" not in run.title
    swaps = found.swaps / run.hours
    yield (
        "identity swaps",
        "0 with codes, ≤ 1 /h without",
        marked(f"{found.swaps}", swaps <= (0.0 if coded else SWAPS_PER_H)),
    )
    yield (
        "plots on the correct track",
        f"≥ {RIGHT_SHARE:.0%}",
        marked(f"{found.right_share:.2%}", found.right_share >= RIGHT_SHARE),
    )
    yield "of all plots, outliers among them", "", f"{found.all_share:.2%}"
    yield (
        "initiation, scans: median, longest",
        f"≤ {SCANS:g}",
        marked(
            f"{np.median(found.scans):.1f}, {np.max(found.scans):.1f}",
            float(np.max(found.scans)) <= SCANS,
        ),
    )
    yield (
        "false tracks, and the longest, s",
        f"none over {FALSE_S:g} s",
        marked(f"{found.false_tracks}, {found.false_life_s:.0f}", found.false_life_s <= FALSE_S),
    )
    yield "aircraft, confirmed tracks", "", f"{found.aircraft}, {found.tracks}"
    for title, card in (("all updates", run.card), ("after a minute of the track", run.settled)):
        error = card["errors"]["position_m"]
        yield (
            f"median error, {title}",
            f"≤ {MEDIAN_M:g} m",
            marked(f"{error['median']:.1f} m", error["median"] <= MEDIAN_M),
        )
        yield (
            f"RMS error, {title}",
            f"≤ {RMS_M:g} m",
            marked(f"{error['rms']:.1f} m", error["rms"] <= RMS_M),
        )
    for one in run.card["presets"]:
        limit = f"{'≥' if one['at_least'] else '≤'} {one['limit']:g} {one['unit']}"
        yield (
            f"{one['preset']}: {one['requirement']}",
            limit,
            marked(f"{one['found']:.3g} {one['unit']}", one["verdict"] == "pass"),
        )
    for name, unit, (error, ratio) in zip(
        ("range", "azimuth"), (" m", "°"), run.biases, strict=True
    ):
        digits = 1 if unit == " m" else 4
        yield (
            f"worst error of a bias of {name}, error / sigma",
            "within 3 sigma",
            marked(f"{error:.{digits}f}{unit}, {ratio:.1f}", ratio <= 3.0),
        )


def marked(text: str, met: bool) -> str:
    """Return a figure, bold where it is outside its limit."""
    return text if met else f"**{text}**"


def manoeuvre_tables(runs: int) -> Iterator[str]:
    """Print and give the tables of the manoeuvres."""
    head = "| {}, legs of {:g} s within ± {:g} km | straights | turns | changing speed | all |"
    for extent_m, straight_s in SCENES:
        for known in (True, False):
            flown = manoeuvres.flights(
                runs, aircraft=30, duration_s=1500.0, known=known, extent_m=extent_m,
                straight_s=straight_s,
            )  # fmt: skip
            best = manoeuvres.best_constant(flown, manoeuvres.DENSITIES)
            against = manoeuvres.figures(best, flown)
            title = "biases known" if known else "biases estimated"
            lines = [
                head.format(title, straight_s, extent_m / 1e3),
                "|---|---|---|---|---|",
                f"| limit | ≤ −{BELOW['straights']:.0%} | ≤ −{BELOW['turns']:.0%} | | |",
                row(f"best constant noise, {best.acceleration_density:g} m²/s³", against, against),
            ]
            for name in FILTERS:
                found = manoeuvres.figures(TrackingSettings(filter_name=name), flown)
                lines.append(row(f"`{name}`", found, against))
            table = "\n".join(lines)
            print(f"\n{table}", flush=True)
            yield table


def row(
    name: str, found: dict[str, manoeuvres.Figure], against: dict[str, manoeuvres.Figure]
) -> str:
    """Return root mean squares, how far below those of the best constant noise, and NEES."""
    parts = [name]
    for kind in manoeuvres.CLASSES:
        change = found[kind].rms_m / against[kind].rms_m - 1.0
        text = f"{found[kind].rms_m:.1f} m"
        if found is not against:
            text += f" ({change:+.0%})".replace("-", "−")
        met = found is against or name == "`two-stage`" or change <= -BELOW.get(kind, -np.inf)
        parts.append(f"{marked(text, met)}, {found[kind].nees:.2f}")
    return f"| {' | '.join(parts)} |"


if __name__ == "__main__":
    main()
