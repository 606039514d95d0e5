"""`multiradar evaluate`: evaluation of tracks against a reference."""

import dataclasses
import json
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.evaluation.document import flag_of, print_scorecard, scorecard_document
from multiradar.cli.options import JsonOption
from multiradar.cli.terminal.view_hint import view_hint
from multiradar.errors import InputError

if TYPE_CHECKING:
    from multiradar.cli.evaluation.inputs import Known
    from multiradar.evaluation.card.figures import Figures
    from multiradar.evaluation.coverage import CoveredRegion
    from multiradar.evaluation.scorecard import Scorecard
    from multiradar.evaluation.settings import EvaluationSettings

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
    processor: Annotated[
        str | None,
        typer.Option(
            metavar="SAC-SIC",
            help="For --system-tracks: the processor, where the recording has several.",
            show_default=False,
        ),
    ] = None,
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sensors of the tracks: coverage, and range and azimuth differences by radar.",
            show_default="sensors.toml in TRACKS",
        ),
    ] = None,
    measurements: Annotated[
        Path | None,
        typer.Option(
            metavar="MEASUREMENTS",
            help="Plots of the tracks, for the differences by radar.",
            show_default="those of the reference",
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
    whole_reference: Annotated[
        bool,
        typer.Option(
            "--whole-reference",
            help="Compare positions outside the coverage of the sensors, too.",
        ),
    ] = False,
    tentative: Annotated[
        bool, typer.Option("--tentative", help="Include tentative tracks.")
    ] = False,
    json_wanted: JsonOption = False,
) -> None:
    """Evaluate tracks against a reference: errors, gaps, swaps, OSPA, SIAP, NEES, presets."""
    chosen = _Reference(
        truth, adsb, smoothed, system_tracks, processor, sensors, measurements, smoother
    )
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
            "whole_reference": whole_reference,
        }
    )
    names = [one.value for one in dict.fromkeys(preset or list(PresetChoice))]
    with ExitStack() as held:
        from multiradar.storage.output_file import new_file

        page = None if html is None else held.enter_context(new_file(html))
        card, figures = _evaluated(tracks, chosen, settings, names)
        if page is not None:
            from multiradar.report.page import report_page

            text = report_page(scorecard_document(tracks, card, figures, whole=True))
            page.write_text(text, encoding="utf-8")
    if json_wanted:
        from multiradar_schemas.rounding import rounded

        print(json.dumps(rounded(figures), ensure_ascii=False, allow_nan=False))
    else:
        print_scorecard(scorecard_document(tracks, card, figures, whole=False))
        if html is not None:
            print(f"report written to {html}")
        print(view_hint(tracks, chosen.plots()))
    compared: Any = figures["compared"]
    if not compared["updates_compared"]:
        when = f" after the first {settling:g} s of each track (--settling)" if settling else ""
        msg = f"no update was compared with the reference{when}; compare the times of both"
        raise InputError(msg)
    if strict and any(one.outcome != "pass" for one in card.preset_results):
        raise typer.Exit(_FAILED)


@dataclasses.dataclass(frozen=True, slots=True)
class _Reference:
    truth: Path | None
    adsb: Path | None
    smoothed: Path | None
    system_tracks: Path | None
    processor: str | None
    sensors: Path | None
    measurements: Path | None
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
        if self.smoothed is None and self.smoother is not None:
            raise typer.BadParameter("--smoother is for --smoothed only")
        if self.system_tracks is None and self.processor is not None:
            raise typer.BadParameter("--processor is for --system-tracks only")

    def _recorded(self) -> bool:
        from multiradar.cli.evaluation.recorded import is_recorded_truth

        return is_recorded_truth(self.truth)

    def read(self, tracks: Path, sensors: Path | None, settings: "EvaluationSettings") -> "Known":
        from multiradar.cli.evaluation.inputs import read_recorded, read_truth
        from multiradar.cli.evaluation.tracked import read_regions

        regions = read_regions(tracks, None if settings.whole_reference else sensors)
        if self.truth is None:
            return self._read(tracks, sensors, settings, regions)
        if not self._recorded():
            return read_truth(self.truth, settings, regions)
        alone = self.adsb is self.smoothed is self.system_tracks is None
        known = None if alone else self._read(tracks, sensors, settings, regions)
        return read_recorded(self.truth, known, settings, regions)

    def _read(
        self,
        tracks: Path,
        sensors: Path | None,
        settings: "EvaluationSettings",
        regions: "Sequence[CoveredRegion]",
    ) -> "Known":
        from multiradar.cli.evaluation.inputs import read_reports, read_smoothed, read_system_tracks

        if self.adsb is not None:
            return read_reports(self.adsb, settings, regions)
        if self.system_tracks is not None:
            return read_system_tracks(self.system_tracks, settings, regions, self.processor)
        assert self.smoothed is not None
        if sensors is None:
            msg = (
                f"missing option --sensors FILE, which --smoothed needs ({tracks} has no "
                "sensors.toml)"
            )
            raise typer.BadParameter(msg)
        smoother = (self.smoother or SmootherChoice.CONSTANT_VELOCITY).value
        return read_smoothed(self.smoothed, sensors, tracks, settings, smoother, regions=regions)

    def plots(self) -> Path | None:
        """Return the measurements of the tracks: those given, or those of the reference."""
        from multiradar.storage.recording import measurements_path

        if self.measurements is not None:
            return self.measurements
        candidates = (self.adsb, self.smoothed, self.truth, self.system_tracks)
        folders = [one for one in candidates if one is not None and one.suffix != ".json"]
        known = [one for one in folders if one.is_dir() or one in {self.adsb, self.smoothed}]
        return next((one for one in known if measurements_path(one).is_file()), None)


def _settings(given: dict[str, float | bool | None]) -> "EvaluationSettings":
    from multiradar.errors import ConfigurationError
    from multiradar.evaluation.settings import EvaluationSettings

    chosen: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    try:
        return EvaluationSettings(**chosen)
    except ConfigurationError as error:
        name, _, reason = str(error).partition(": ")
        raise typer.BadParameter(f"{flag_of(name)}: {reason}") from error


def _evaluated(
    tracks: Path,
    chosen: "_Reference",
    settings: "EvaluationSettings",
    presets: Sequence[str],
) -> "tuple[Scorecard, Figures]":
    from multiradar.cli.evaluation.inputs import radar_plots
    from multiradar.cli.evaluation.tracked import (
        read_biases,
        read_forecasts,
        read_tracks,
        sensors_file,
    )
    from multiradar.cli.inputs import read_sensors
    from multiradar.evaluation.card.figures import figures_of, row_figures
    from multiradar.evaluation.overlap import check_matched, outside, rarely_matched
    from multiradar.evaluation.reference_checks import (
        clock_offset,
        height_unit,
        mostly_uncovered,
        rejected_rows,
        shared_sensors,
    )
    from multiradar.evaluation.scorecard import evaluate as evaluate_tracks

    sensors = sensors_file(tracks, chosen.sensors)
    known = chosen.read(tracks, sensors, settings)
    counts = known.reference.counts
    for sentence in rejected_rows(counts) + mostly_uncovered(counts):
        print(f"multiradar: {sentence}", file=sys.stderr)
    evaluated = read_tracks(tracks, known, settings)
    listed = () if sensors is None else read_sensors(sensors).sensor
    card = evaluate_tracks(
        evaluated,
        known.reference,
        settings,
        presets,
        plots=known.plots,
        biases=read_biases(tracks, known),
        sensors=listed,
        radar_plots=radar_plots(chosen.plots()),
        forecasts=read_forecasts(tracks),
    )
    check_matched(evaluated, known.reference, card.instants.track_of, settings.gate_m)
    sentences = outside(evaluated, known.reference, settings.gate_m) or rarely_matched(
        card.instants.track_of, settings.gate_m
    )
    sentences += clock_offset(evaluated, card.errors) + height_unit(evaluated, card.errors)
    # ADS-B converted alone may have the name of a radar or multilateration of the tracks.
    named_alike = {one.id for one in listed if one.kind != "adsb"}
    sentences += shared_sensors(evaluated, sorted({*known.reporters} - named_alike))
    for sentence in sentences:
        print(f"multiradar: {sentence}", file=sys.stderr)
    what: Figures = {"kind": known.kind, "path": str(known.path), **known.claimed}
    what |= row_figures(counts)
    if chosen.sensors is not None:
        what["sensors"] = str(chosen.sensors)
    if chosen.measurements is not None:
        what["measurements"] = str(chosen.measurements)
    return card, {"reference": what, **figures_of(card)}
