"""`multiradar evaluate`: evaluation of tracks against a reference."""

import dataclasses
import json
import re
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.options import JsonOption

if TYPE_CHECKING:
    from multiradar.cli.evaluation.inputs import Known
    from multiradar.evaluation.card.figures import Figures
    from multiradar.evaluation.scorecard import Scorecard
    from multiradar.evaluation.settings import EvaluationSettings
    from multiradar.report.content import Document

#: Number of aircraft in the terminal; the report has all.
_WORST = 8
_FAILED = 1
#: Part of the names of settings that options omit.
_UNIT = re.compile(r"(_max)?_(m|s)$")
#: Width of the tables where standard output is no terminal.
_WIDTH_UNKNOWN = 160
_REFERENCES = {
    "truth": "the truth of a simulation",
    "recorded": "the ADS-B reports of the dump",
    "adsb": "ADS-B reports",
    "smoothed": "all measurements, smoothed",
    "system-tracks": "the system tracks of another processor",
}


class PresetChoice(StrEnum):
    """Names of the presets of `multiradar.evaluation.presets`, not imported: help must be fast."""

    ED142_ENROUTE = "ed142-enroute"
    ED142_TMA = "ed142-tma"
    ESASSP_3NM = "esassp-3nm"
    ESASSP_5NM = "esassp-5nm"


class SmootherChoice(StrEnum):
    """Names of `multiradar.evaluation.smoothing.reference`, not imported: help must be fast."""

    CONSTANT_VELOCITY = "constant-velocity"
    IMM = "imm"


def _number(flag: str, text: str, default: float | str) -> Any:
    return typer.Option(flag, metavar="NUMBER", help=text, show_default=str(default))


def evaluate(
    tracks: Annotated[
        Path,
        typer.Argument(
            metavar="TRACKS",
            help="Output directory of `track`, or its tracks.parquet.",
            show_default=False,
        ),
    ],
    *,
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Reference: output directory of `simulate`. Or the truth.json of a dump: true "
            "biases beside another reference, without one beside the dump's ADS-B.",
            show_default=False,
        ),
    ] = None,
    adsb: Annotated[
        Path | None,
        typer.Option(
            metavar="MEASUREMENTS",
            help="Reference: ADS-B reports of a measurements.parquet, or of an output directory of "
            "`convert`.",
            show_default=False,
        ),
    ] = None,
    smoothed: Annotated[
        Path | None,
        typer.Option(
            metavar="MEASUREMENTS",
            help="Reference: all measurements of a measurements.parquet, corrected by the biases "
            "of TRACKS and smoothed; needs --sensors.",
            show_default=False,
        ),
    ] = None,
    system_tracks: Annotated[
        Path | None,
        typer.Option(
            metavar="TRACKS",
            help="Reference: system tracks of a recording: output directory of `convert "
            "asterix` or `convert vid` (240_mr), or one file of it.",
            show_default=False,
        ),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="For --smoothed: sensor configuration, sensors.toml.",
            show_default=False,
        ),
    ] = None,
    smoother: Annotated[
        SmootherChoice | None,
        typer.Option(
            help="For --smoothed: motion model; `imm`: straight, turning, changing speed.",
            show_default="constant-velocity",
        ),
    ] = None,
    preset: Annotated[
        list[PresetChoice] | None,
        typer.Option(help="Requirements to evaluate; repeatable.", show_default="all of them"),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit with status 1 unless every requirement is met."),
    ] = False,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="HTML report with maps and plots; must not exist.",
            show_default=False,
        ),
    ] = None,
    step: Annotated[
        float | None, _number("--step", "Time between evaluation instants, s.", 4)
    ] = None,
    gate: Annotated[float | None, _number("--gate", "Association radius, m.", 2000)] = None,
    age: Annotated[
        float | None, _number("--age", "Maximum extrapolation (coasting) time, s.", 12)
    ] = None,
    reference_gap: Annotated[
        float | None,
        _number(
            "--reference-gap",
            "Do not interpolate the reference across gaps longer than this, s.",
            15,
        ),
    ] = None,
    gap: Annotated[
        float | None, _number("--gap", "Minimum time without an update to count as a gap, s.", 16.4)
    ] = None,
    cutoff: Annotated[
        float | None, _number("--cutoff", "Cut-off c of OSPA and GOSPA, m.", 1000)
    ] = None,
    order: Annotated[float | None, _number("--order", "Order p of OSPA and GOSPA.", 2)] = None,
    dwell: Annotated[
        float | None,
        _number("--dwell", "Minimum dwell on another aircraft to count as a swap, s.", 20),
    ] = None,
    settling: Annotated[
        float | None, _number("--settling", "Ignore errors during the first … s of a track.", 0)
    ] = None,
    reference_sigma: Annotated[
        float | None,
        _number("--reference-sigma", "Standard deviation of the reference itself, m.", 0),
    ] = None,
    density: Annotated[
        float | None,
        _number("--density", "For --smoothed: spectral density of accelerations, m²/s³.", 30),
    ] = None,
    scan_period: Annotated[
        float | None,
        _number("--scan-period", "Scan period, to give delays in scans, s.", "none"),
    ] = None,
    partial: Annotated[
        bool,
        typer.Option(
            "--partial",
            help="The reference may lack aircraft: tracks without one are not false.",
        ),
    ] = False,
    tentative: Annotated[
        bool, typer.Option("--tentative", help="Include tentative tracks.")
    ] = False,
    json_wanted: JsonOption = False,
) -> None:
    """Evaluate tracks against a reference: errors, gaps, swaps, OSPA, SIAP, NEES, presets."""
    chosen = _Reference(truth, adsb, smoothed, system_tracks, sensors, smoother)
    chosen.check()
    settings = _settings(
        {
            "step_s": step,
            "gate_m": gate,
            "age_max_s": age,
            "reference_gap_s": reference_gap,
            "gap_s": gap,
            "cutoff_m": cutoff,
            "order": order,
            "dwell_s": dwell,
            "settling_s": settling,
            "reference_sigma_m": reference_sigma,
            "density": density,
            "scan_period_s": scan_period,
            "partial": partial,
            "tentative": tentative,
        }
    )
    names = [one.value for one in dict.fromkeys(preset or list(PresetChoice))]
    with ExitStack() as held:
        from multiradar.storage.output_file import new_file

        page = None if html is None else held.enter_context(new_file(html))
        card, figures = _evaluated(tracks, chosen, settings, names)
        if page is not None:
            from multiradar.report.page import report_page

            text = report_page(_document(tracks, card, figures, whole=True))
            page.write_text(text, encoding="utf-8")
    if json_wanted:
        from multiradar_schemas.rounding import rounded

        print(json.dumps(rounded(figures), ensure_ascii=False, allow_nan=False))
    else:
        _print(_document(tracks, card, figures, whole=False))
        if html is not None:
            print(f"report written to {html}")
    if strict and any(one.outcome != "pass" for one in card.preset_results):
        raise typer.Exit(_FAILED)


@dataclasses.dataclass(frozen=True, slots=True)
class _Reference:
    truth: Path | None
    adsb: Path | None
    smoothed: Path | None
    system_tracks: Path | None
    sensors: Path | None
    smoother: SmootherChoice | None

    def check(self) -> None:
        options = {
            "--truth DIR": self.truth,
            "--adsb MEASUREMENTS": self.adsb,
            "--smoothed MEASUREMENTS": self.smoothed,
            "--system-tracks TRACKS": self.system_tracks,
        }
        given = [name for name, one in options.items() if one is not None]
        others = [name for name in given if name != "--truth DIR"]
        # The truth of a dump may accompany another reference.
        if len(given) != 1 and not (len(others) == 1 and self._recorded()):
            known = ", ".join(options)
            if given:
                msg = f"expected one reference, was {' and '.join(given)}"
                raise typer.BadParameter(msg)
            raise typer.BadParameter(f"missing reference: one of {known}")
        if self.smoothed is not None and self.sensors is None:
            raise typer.BadParameter("missing option --sensors FILE, which --smoothed needs")
        if self.smoothed is None and self.sensors is not None:
            raise typer.BadParameter("--sensors FILE is for --smoothed only")
        if self.smoothed is None and self.smoother is not None:
            raise typer.BadParameter("--smoother is for --smoothed only")

    def _recorded(self) -> bool:
        from multiradar.cli.evaluation.recorded import is_recorded_truth

        return is_recorded_truth(self.truth)

    def read(self, tracks: Path, settings: "EvaluationSettings") -> "Known":
        from multiradar.cli.evaluation.inputs import read_recorded, read_truth

        if self.truth is None:
            return self._read(tracks, settings)
        if not self._recorded():
            return read_truth(self.truth, settings)
        alone = self.adsb is self.smoothed is self.system_tracks is None
        known = None if alone else self._read(tracks, settings)
        return read_recorded(self.truth, known, settings)

    def _read(self, tracks: Path, settings: "EvaluationSettings") -> "Known":
        from multiradar.cli.evaluation.inputs import read_reports, read_smoothed, read_system_tracks

        if self.adsb is not None:
            return read_reports(self.adsb, settings)
        if self.system_tracks is not None:
            return read_system_tracks(self.system_tracks, settings)
        assert self.smoothed is not None
        assert self.sensors is not None
        smoother = self.smoother or SmootherChoice.CONSTANT_VELOCITY
        return read_smoothed(self.smoothed, self.sensors, tracks, settings, smoother.value)


def _settings(given: dict[str, float | bool | None]) -> "EvaluationSettings":
    from multiradar.errors import ConfigurationError
    from multiradar.evaluation.settings import EvaluationSettings

    chosen: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    try:
        return EvaluationSettings(**chosen)
    except ConfigurationError as error:
        name, _, reason = str(error).partition(": ")
        raise typer.BadParameter(f"{_flag(name)}: {reason}") from error


def _evaluated(
    tracks: Path,
    chosen: "_Reference",
    settings: "EvaluationSettings",
    presets: Sequence[str],
) -> "tuple[Scorecard, Figures]":
    from multiradar.cli.evaluation.inputs import read_biases, read_forecasts, read_tracks
    from multiradar.evaluation.card.figures import figures_of, row_figures
    from multiradar.evaluation.overlap import check_matched, outside, rarely_matched
    from multiradar.evaluation.reference_checks import (
        clock_offset,
        height_unit,
        rejected_rows,
        shared_sensors,
    )
    from multiradar.evaluation.scorecard import evaluate as evaluate_tracks

    known = chosen.read(tracks, settings)
    for sentence in rejected_rows(known.reference.counts):
        print(f"multiradar: {sentence}", file=sys.stderr)
    evaluated = read_tracks(tracks, known, settings)
    card = evaluate_tracks(
        evaluated,
        known.reference,
        settings,
        presets,
        plots=known.plots,
        biases=read_biases(tracks, known),
        forecasts=read_forecasts(tracks),
    )
    check_matched(evaluated, known.reference, card.instants.track_of, settings.gate_m)
    sentences = outside(evaluated, known.reference, settings.gate_m) or rarely_matched(
        card.instants.track_of, settings.gate_m
    )
    sentences += clock_offset(evaluated, card.errors) + height_unit(evaluated, card.errors)
    sentences += shared_sensors(evaluated, known.reporters)
    for sentence in sentences:
        print(f"multiradar: {sentence}", file=sys.stderr)
    what: Figures = {"kind": known.kind, "path": str(known.path), **known.claimed}
    what |= row_figures(known.reference.counts)
    return card, {"reference": what, **figures_of(card)}


def _document(tracks: Path, card: "Scorecard", figures: Any, *, whole: bool) -> "Document":
    from multiradar.evaluation.card.plots import card_plots
    from multiradar.evaluation.card.tables import (
        aircraft_table,
        card_tables,
        notes_of,
        preset_table,
        rejects_tables,
    )
    from multiradar.report.content import Document

    compared, reference = figures["compared"], figures["reference"]
    summary = (
        f"{_headline(compared)} with {compared['updates']} updates against "
        f"{_REFERENCES[reference['kind']]}: {compared['aircraft']} aircraft with "
        f"{compared['reference_positions']} positions over {compared['duration_s']:.0f} s; "
        f"{compared['updates_compared']} updates compared."
    )
    most = None if whole else _WORST
    return Document(
        title="Scorecard of tracks",
        summary=summary,
        command=_command(tracks, figures),
        tables=[
            preset_table(figures),
            *card_tables(figures),
            aircraft_table(figures, most),
            *rejects_tables(figures, most),
        ],
        plots=card_plots(card) if whole else [],
        notes=notes_of(card, figures),
    )


def _headline(compared: Any) -> str:
    text = f"{compared['tracks_confirmed']} confirmed tracks"
    return f"{text} ({compared['tracks_initiated']} initiated)"


# Only options that differ from the defaults.
def _command(tracks: Path, figures: Any) -> str:
    from multiradar.evaluation.settings import EvaluationSettings

    reference = figures["reference"]
    option = "truth" if reference["kind"] == "recorded" else reference["kind"]
    parts = ["multiradar evaluate", str(tracks), f"--{option}", reference["path"]]
    if "truth" in reference:
        parts += ["--truth", reference["truth"]]
    if "sensors" in reference:
        parts += ["--sensors", reference["sensors"]]
    if reference.get("smoother") == SmootherChoice.IMM:
        parts += ["--smoother", SmootherChoice.IMM.value]
    for name, value in dataclasses.asdict(EvaluationSettings()).items():
        given = figures["settings"][name]
        if given != value:
            parts += [_flag(name)] if given is True else [_flag(name), f"{given:g}"]
    return " ".join(parts)


def _flag(name: str) -> str:
    return f"--{_UNIT.sub('', name).replace('_', '-')}"


def _print(document: "Document") -> None:
    from rich.console import Console

    from multiradar.cli.terminal.report_tables import print_document

    width = None if sys.stdout.isatty() else _WIDTH_UNKNOWN
    print_document(document, Console(highlight=False, markup=False, width=width))
