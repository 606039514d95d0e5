"""Evaluates the sample and two scenarios, and puts the figures into docs/howto/evaluate.md.

::

    python -m validation.documents.make_evaluate
"""

import argparse
import tempfile
from pathlib import Path

import multiradar as mr
from multiradar.evaluation.card.figures import Figures, figures_of
from multiradar.evaluation.card.plots import card_plots
from multiradar.evaluation.card.tables import card_tables, preset_table
from multiradar.evaluation.presets import PRESETS
from multiradar.evaluation.scorecard import Scorecard, evaluate
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.report.cells import plain_text
from multiradar.report.content import Table, Value
from multiradar.report.markdown import markdown_table
from multiradar.report.plot_files import plot_svg
from multiradar.toolbox.evaluation.inputs import read_reports, read_truth, recorded_rows
from multiradar.toolbox.evaluation.known import Known
from multiradar.toolbox.evaluation.tracked import (
    read_biases,
    read_regions,
    read_tracks,
    sensors_file,
)
from multiradar.toolbox.inputs import read_sensors
from validation.documents.marked_parts import put

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLES = DOCS.parent / "examples"
SCENES = ("manoeuvring-traffic", "rotating-gaps")
SETTINGS = EvaluationSettings()
#: Name of the plot of the sample on the page.
PICTURE = "errors-over-time"


def main() -> None:
    """Evaluate the tracks of the sample and of the scenarios, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of evaluate.md")
    docs = parser.parse_args().docs
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        card = sample(folder)
        cards = {"sample recording": card} | {name: scene(folder, name) for name in SCENES}
    figures_by_name = {name: figures_of(one) for name, one in cards.items()}
    shown = [
        preset_table(figures_by_name["sample recording"]),
        *card_tables(figures_by_name["sample recording"]),
    ]
    plots = card_plots(card)
    plot = next(one for one in plots if one.name == PICTURE)
    (docs / "images" / "evaluate.svg").write_text(plot_svg(plots, plot), encoding="utf-8")
    tables = "\n".join(f"**{one.title}**\n\n{markdown_table(one)}" for one in shown)
    put(docs / "howto" / "evaluate.md", "sample", tables)
    put(docs / "howto" / "evaluate.md", "scenes", markdown_table(comparison(figures_by_name)))


def sample(folder: Path) -> Scorecard:
    """Return the scorecard of the sample recording, tracked without ADS-B."""
    converted, tracks = folder / "converted", folder / "tracks"
    mr.convert(EXAMPLES / "vid-sample", date="2018-08-01", out=converted)
    mr.track(converted, EXAMPLES / "sensors-vid-sample.toml", kinds=["radar"], out=tracks)
    regions = read_regions(tracks, sensors_file(tracks, None))
    return scorecard(tracks, read_reports(converted, SETTINGS, regions), converted)


def scene(folder: Path, name: str) -> Scorecard:
    """Return the scorecard of a scenario against its truth."""
    made, tracks = folder / name, folder / f"{name}-tracks"
    mr.simulate(name, out=made)
    mr.track(made, made / "sensors.toml", out=tracks)
    regions = read_regions(tracks, sensors_file(tracks, None))
    return scorecard(tracks, read_truth(made, SETTINGS, regions), made)


def scorecard(tracks: Path, known: Known, measurements: Path) -> Scorecard:
    """Return the scorecard of tracks, as the command does."""
    sensors = sensors_file(tracks, None)
    rows = recorded_rows(measurements, may_be_empty=False)
    assert sensors is not None
    assert rows is not None
    return evaluate(
        read_tracks(tracks, known, SETTINGS),
        known.reference,
        SETTINGS,
        tuple(PRESETS),
        plots=known.plots,
        biases=read_biases(tracks, known),
        sensors=read_sensors(sensors).sensor,
        radar_plots=rows.filter(kind="radar"),
    )


def comparison(figures_by_name: dict[str, Figures]) -> Table:
    """Return the main figures of all scenarios, side by side."""
    lines = (
        ("aircraft", "compared", "aircraft", ""),
        ("position error, RMS, m", "errors", "position_m", "rms"),
        ("position error, median, m", "errors", "position_m", "median"),
        ("along track, RMS, m", "errors", "along_m", "rms"),
        ("across track, RMS, m", "errors", "across_m", "rms"),
        ("velocity error, RMS, m/s", "errors", "velocity_mps", "rms"),
        ("heading error, RMS, °", "errors", "heading_deg", "rms"),
        ("completeness", "siap", "completeness", ""),
        ("initiation delay, median, s", "initiation", "median_s", ""),
        ("longest gap, s", "continuity", "longest_gap_s", ""),
        ("identity swaps", "identity", "swaps", ""),
        ("false tracks", "tracks", "false", ""),
        ("OSPA, mean, m", "ospa", "mean_m", ""),
        ("NEES of position", "nees", "position", "mean"),
    )
    rows = [
        (title, *(value_of(figures, part, name, key) for figures in figures_by_name.values()))
        for title, part, name, key in lines
    ]
    return Table("Scenes", ("measure", *figures_by_name), tuple(rows))


def value_of(figures: Figures, part: str, name: str, key: str) -> Value:
    """Return one figure as text of at most four digits."""
    found = figures[part][name]  # type: ignore[index, call-overload]
    value = found[key] if key else found  # type: ignore[index, call-overload]
    return plain_text(float(value), 4)  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
