"""`multiradar inspect`: what recordings contain, as text, JSON or one HTML page."""

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import JsonOption, ReferenceOption, read_references
from multiradar.errors import DataWarning, FindingsError, InputError
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.conversion.convert import bytes_bar, conversion_errors
from multiradar.toolbox.messages.warning import warn

if TYPE_CHECKING:
    from multiradar_converters.inspection.survey import Survey
    from multiradar_schemas.inspection import Inspection

_WIDTH = 160
_TRUNCATED, _DUPLICATE = "TRUNCATED", "DUPLICATE"

INSPECT_HELP = (
    "Inspect recordings before conversion.\n\n"
    "FILE… are ASTERIX recordings of any format and ADS-B trajectories, in chronological order, "
    "or directories of text dumps; together they form one recording. The output lists "
    "categories and editions, sensors, times, gaps, data rates, duplicates, coverage, "
    "identification, BDS registers, rejected records with their reasons, and a suggested "
    "sensors.toml. Files are written only if requested by an option."
)


def inspect(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE…", help="Recordings.", show_default=False),
    ],
    *,
    toml: Annotated[
        Path | None,
        typer.Option(
            "--toml",
            metavar="FILE",
            help="New file: the suggested sensors.toml.",
            show_default=False,
        ),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="New file: an HTML report with a map.",
            show_default=False,
        ),
    ] = None,
    sites: Annotated[
        Path | None,
        typer.Option(
            metavar="CSV",
            help="CSV file of radar sites with the columns sac, sic, latitude_deg, longitude_deg, "
            "height_m.",
            show_default="sites in the recording, or estimated from its plots",
        ),
    ] = None,
    reference: ReferenceOption = None,
    edition: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[SAC-SIC/]CATEGORY=EDITION",
            help="Edition of a category, as for `convert asterix`; repeatable.",
            show_default="the newest that decodes the recording",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Inspect recordings before conversion."""
    from multiradar.cli.inspection.sites import (
        read_sites,
        reference_sites,
        references_of_sites,
        solved_sites,
    )
    from multiradar.storage.output_file import new_file
    from multiradar_converters.asterix.decoding.editions import parse_editions
    from multiradar_converters.errors import ProfileError
    from multiradar_converters.inspection.document import inspection_of, stated_sites
    from multiradar_converters.inspection.recordings import InspectionOptions
    from multiradar_converters.inspection.recordings import inspect as survey_files
    from multiradar_converters.repeated_files import repeated_sentence
    from multiradar_schemas.rounding import rounded

    try:
        editions = parse_editions(edition or [])
    except ProfileError as error:
        raise typer.BadParameter(str(error), param_hint="--edition") from error
    table = {} if sites is None else read_sites(sites)
    table |= reference_sites(given := read_references(reference))
    references = references_of_sites(table) | given
    with ExitStack() as held:
        suggestion = None if toml is None else held.enter_context(new_file(toml))
        page = None if html is None else held.enter_context(new_file(html))
        compile_kernels(["convert asterix"])
        with conversion_errors(), bytes_bar(_octets(files)) as advance:
            survey = survey_files(
                files, InspectionOptions(editions, references=references), advance
            )
        for sentence in map(repeated_sentence, files):
            if sentence:
                warn(sentence, DataWarning)
        known = stated_sites(survey) | table
        found = inspection_of(survey, solved_sites(survey, known) | known)
        if suggestion is not None:
            suggestion.write_text(found.sensors_toml, encoding="utf-8")
        if page is not None:
            page.write_text(_page(found, survey, _command(files)), encoding="utf-8")
    if as_json:
        figures = rounded(found.model_dump(mode="json"))
        print(json.dumps(figures, indent=1, ensure_ascii=False, allow_nan=False))
    else:
        _print(found, _command(files))
    _check(found, survey, edition or [], list(editions.doubtful.values()))


def _check(
    found: "Inspection", survey: "Survey", chosen: list[str], doubts: list[str]
) -> None:  # fmt: skip
    _warn_of_times(found)
    _fail_when_unreadable(found, doubts)
    _fail_when_truncated(found)
    _fail_when_unused(chosen, found)
    _fail_when_mistaken(found, survey)


def _page(found: "Inspection", survey: "Survey", command: str) -> str:
    from multiradar.cli.inspection.plots import inspection_plots
    from multiradar.cli.inspection.tables import inspection_document
    from multiradar.report.page import report_page

    return report_page(inspection_document(found, command, inspection_plots(found, survey)))


def _print(found: "Inspection", command: str) -> None:
    from rich.console import Console

    from multiradar.cli.inspection.tables import inspection_document
    from multiradar.cli.terminal.report_tables import print_document

    # Tables are not cut where they are read by a program.
    width = None if sys.stdout.isatty() else _WIDTH
    console = Console(highlight=False, markup=False, width=width)
    print_document(inspection_document(found, command), console)


def _octets(files: list[Path]) -> int:
    parts = [part for path in files for part in (path.iterdir() if path.is_dir() else (path,))]
    return sum(part.stat().st_size for part in parts if part.is_file())


def _command(files: list[Path]) -> str:
    return " ".join(["multiradar inspect", *map(str, files)])


# Recordings of different days are inspected as one.
def _warn_of_times(found: "Inspection") -> None:
    from multiradar.diagnosis.evidence import Source
    from multiradar.diagnosis.same_aircraft.outages import check_gaps, check_outages
    from multiradar.diagnosis.times import DATELESS_MAX_S, check_times

    sources = {}
    for one in found.sensors:
        if one.first_s is None or one.last_s is None:
            continue
        longest = max(one.longest_gaps, key=lambda gap: gap.duration_s, default=None)
        source = Source(read=one.reports, first_s=one.first_s, last_s=one.last_s)
        if longest is not None:
            source.gap_s, source.gap_from_s = longest.duration_s, longest.first_s
        sources[one.sensor_id] = source
    # Times of day are compared with the times of day of other recordings.
    dated = {name: one for name, one in sources.items() if one.first_s >= DATELESS_MAX_S}
    undated = {name: one for name, one in sources.items() if name not in dated}
    times = [*check_times(dated), *check_times(undated)]
    for diagnosis in [*times, *check_gaps(sources), *check_outages(sources)]:
        warn(diagnosis.sentence, DataWarning)


# The figures are those of what is there.
def _fail_when_truncated(found: "Inspection") -> None:
    cut = [f"{one.file}: {one.reason}" for one in found.rejects if one.code == _TRUNCATED]
    if cut:
        msg = f"{'; '.join(cut)}; probably truncated during copying"
        raise InputError(msg)


# An option for a source that is not in the recording is a misspelt one.
def _fail_when_unused(chosen: list[str], found: "Inspection") -> None:
    recorded = {(one.sensor, int(one.category)) for one in found.categories}
    recorded |= {("", category) for _, category in recorded}
    unused = []
    for text in chosen:
        source, _, category = text.partition("=")[0].rpartition("/")
        if (source, int(category)) not in recorded:
            unused.append(f"--edition {text}")
    if unused:
        known = ", ".join(f"{one.category} of {one.sensor}" for one in found.categories)
        msg = (
            f"{', '.join(unused)}: not in the recording, which contains {known}; correct or omit "
            "the option"
        )
        raise InputError(msg)


# Units and columns that the recording itself shows to be wrong.
def _fail_when_mistaken(inspection: "Inspection", survey: "Survey") -> None:
    from multiradar.cli.inspection.sites import plots_of_reports
    from multiradar.diagnosis.conversion import check_plots, check_reported

    found = []
    for (name, kind), one in survey.sensors.items():
        plots = plots_of_reports(one.sample.reports(), of_day=False)
        check = check_plots if kind == "radar" else check_reported
        found += [diagnosis.sentence for diagnosis in check(name, plots)]
    if found:
        raise FindingsError(found, inspection)


def _fail_when_unreadable(found: "Inspection", doubts: list[str]) -> None:
    """Exit with status 1 if most of the recordings is unreadable, or by another edition only.

    Raises
    ------
    InputError
        With the most frequent reason.
    """
    if doubts:
        raise InputError("; ".join(doubts))
    for one in found.files:
        reasons = [each for each in found.rejects if each.file == one.file]
        # Copies, such as repeated positions of ADS-B, can be read.
        copies = sum(each.count for each in reasons if each.code == _DUPLICATE)
        part, whole, unit = one.rejected - copies, one.read, "records"
        if one.quarantined_bytes is not None:
            part, whole, unit = one.quarantined_bytes, one.bytes, "octets"
        if 2 * part > whole:
            msg = (
                f"{one.file}: {part / whole:.0%} of its {unit} could not be read: "
                f"{reasons[0].reason or reasons[0].code}"
            )
            raise InputError(msg)
    if not found.sensors and not found.categories and not found.system_tracks:
        names = ", ".join(one.file for one in found.files)
        msg = f"{names}: no records found; expected ASTERIX, a text dump or ADS-B trajectories"
        raise InputError(msg)
