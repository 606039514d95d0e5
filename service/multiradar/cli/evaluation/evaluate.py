"""`multiradar evaluate`: evaluation of tracks against a reference."""

import json
import sys
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.options import JsonOption
from multiradar.cli.terminal.findings import with_findings
from multiradar.cli.terminal.view_hint import view_hint
from multiradar.errors import ArgumentError

if TYPE_CHECKING:
    from multiradar.report.content import Document

#: Width of the tables where standard output is not a terminal.
_WIDTH_UNKNOWN = 160
_FAILED = 1


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
            help="Reference: output directory of `simulate`, or the truth.json of a dump. The "
            "latter contains true biases only; positions are then compared with a second "
            "reference or, without one, with the ADS-B reports of the dump.",
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
            help="Reference: all measurements of a measurements.parquet, corrected for the biases "
            "of TRACKS and smoothed; requires --sensors.",
            show_default=False,
        ),
    ] = None,
    system_tracks: Annotated[
        Path | None,
        typer.Option(
            metavar="TRACKS",
            help="Reference: system tracks of a recording: output directory of `convert "
            "asterix` or `convert vid` (240_mr), or one of its files.",
            show_default=False,
        ),
    ] = None,
    processor: Annotated[
        str | None,
        typer.Option(
            metavar="SAC-SIC",
            help="For --system-tracks: the processor to use if the recording contains several.",
            show_default=False,
        ),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sensor configuration of the tracks, for coverage and for range and azimuth "
            "differences by radar.",
            show_default="sensors.toml in TRACKS",
        ),
    ] = None,
    measurements: Annotated[
        Path | None,
        typer.Option(
            metavar="MEASUREMENTS",
            help="Plots from which the tracks were formed, for the range and azimuth differences "
            "by radar.",
            show_default="plots of the reference",
        ),
    ] = None,
    smoother: Annotated[
        SmootherChoice | None,
        typer.Option(
            help="For --smoothed: motion model; `imm` covers straight flight, turns and speed "
            "changes.",
            show_default="constant-velocity",
        ),
    ] = None,
    preset: Annotated[
        list[PresetChoice] | None,
        typer.Option(help="Set of requirements to check; repeatable.", show_default="all"),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit with status 1 unless every requirement is met."),
    ] = False,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="New file: an HTML report with maps and plots.",
            show_default=False,
        ),
    ] = None,
    step: Annotated[
        float | None, _number("--step", "Interval between evaluation instants, s.", 4)
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
        float | None,
        _number("--settling", "Initial part of each track in which errors are ignored, s.", 0),
    ] = None,
    reference_sigma: Annotated[
        float | None,
        _number("--reference-sigma", "Standard deviation of the reference itself, m.", 0),
    ] = None,
    density: Annotated[
        float | None,
        _number("--density", "For --smoothed: spectral density of the acceleration, m²/s³.", 30),
    ] = None,
    scan_period: Annotated[
        float | None,
        _number("--scan-period", "Scan period for expressing delays in scans, s.", "none"),
    ] = None,
    partial: Annotated[
        bool,
        typer.Option(
            "--partial",
            help="The reference may be incomplete: tracks without a reference aircraft do not "
            "count as false.",
        ),
    ] = False,
    whole_reference: Annotated[
        bool,
        typer.Option(
            "--whole-reference",
            help="Also compare positions outside the coverage of the sensors.",
        ),
    ] = False,
    tentative: Annotated[
        bool, typer.Option("--tentative", help="Include tentative tracks.")
    ] = False,
    json_wanted: JsonOption = False,
) -> None:
    """Evaluate tracks against a reference: errors, gaps, swaps, OSPA, SIAP, NEES, presets."""
    from multiradar.storage.output_file import new_file
    from multiradar.toolbox.evaluation.document import flag_of
    from multiradar.toolbox.evaluation.evaluate import evaluate as evaluate_tracks
    from multiradar.toolbox.evaluation.evaluate import evaluation_settings

    settings = {
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
        "whole_reference": whole_reference,
    }
    try:
        evaluation_settings(settings)
    except ArgumentError as error:
        raise typer.BadParameter(error.sentence_of(flag_of)) from error
    with ExitStack() as held:
        page = None if html is None else held.enter_context(new_file(html))
        done, findings = with_findings(
            lambda: evaluate_tracks(
                tracks,
                truth=truth,
                adsb=adsb,
                smoothed=smoothed,
                system_tracks=system_tracks,
                processor=processor,
                sensors=sensors,
                measurements=measurements,
                smoother=None if smoother is None else smoother.value,
                presets=None if preset is None else [one.value for one in preset],
                **settings,
            )
        )
        if page is not None:
            page.write_text(done.page(), encoding="utf-8")
    if json_wanted:
        print(json.dumps(done.figures, ensure_ascii=False, allow_nan=False))
    else:
        _print(done.document(whole=False))
        if html is not None:
            print(f"report written to {html}")
        print(view_hint(tracks, done.measurements))
    if findings is not None:
        raise findings
    if strict and not all(done.passed.values()):
        raise typer.Exit(_FAILED)


def _print(document: "Document") -> None:
    from rich.console import Console

    from multiradar.cli.terminal.report_tables import print_document

    width = None if sys.stdout.isatty() else _WIDTH_UNKNOWN
    print_document(document, Console(highlight=False, markup=False, width=width))
