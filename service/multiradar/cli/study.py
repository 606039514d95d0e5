"""`multiradar study`: reproduce the tables and figures of the source papers."""

import json
import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from multiradar.cli.options import JsonOption
from multiradar.errors import ArgumentError
from multiradar.research.studies.catalogue import FLAGS, StudyEntry
from multiradar_schemas.documents.names import unknown

if TYPE_CHECKING:
    from multiradar.research.studies.result import StudyResult

#: Width of the tables where standard output is not a terminal.
WIDTH_UNKNOWN = 160

#: Upper bounds of options.
RUNS_MAX = 1_000_000
DURATION_S_MAX = 86_400.0


def study_command(catalogue: Mapping[str, StudyEntry]) -> Callable[..., None]:
    """Return the command for the studies of a catalogue.

    Parameters
    ----------
    catalogue : mapping of str to StudyEntry
        The studies by name.

    Returns
    -------
    callable
        A command for typer; `study_help` is its help.
    """

    def known_name(text: str) -> str:
        if text not in catalogue:
            raise typer.BadParameter(unknown("study", text, catalogue))
        return text

    def command(
        study: Annotated[
            str,
            typer.Argument(
                metavar="NAME",
                help=f"Study to run: {', '.join(catalogue)}.",
                parser=known_name,
                show_default=False,
            ),
        ],
        *,
        runs: Annotated[
            int | None,
            typer.Option(
                metavar="N",
                help="Number of Monte Carlo runs.",
                parser=_parse_runs,
                show_default="of the study",
            ),
        ] = None,
        seed: Annotated[
            int,
            typer.Option(
                metavar="N",
                help="Random seed; the same seed reproduces the results.",
                parser=_parse_seed,
            ),
        ] = 1,
        filters: Annotated[
            str | None,
            typer.Option(
                metavar="NAME,NAME",
                help="Filters to compare.",
                show_default="all filters of the study",
            ),
        ] = None,
        duration: Annotated[
            float | None,
            typer.Option(
                metavar="SECONDS",
                help="Duration of the scenario, s.",
                parser=_parse_duration,
                show_default="of the study",
            ),
        ] = None,
        out: Annotated[
            Path | None,
            typer.Option(
                metavar="FILE.html",
                help="New file: the HTML report. With --json, a report is written only if this "
                "option is given.",
                show_default="NAME.html, or NAME-2.html … if it already exists",
            ),
        ] = None,
        figures: Annotated[
            Path | None,
            typer.Option(
                metavar="DIR",
                help="New directory for the figures as SVG and PDF, with line styles for print.",
                show_default=False,
            ),
        ] = None,
        json_wanted: JsonOption = False,
    ) -> None:
        entry = catalogue[study]
        chosen = {"runs": runs, "filters": _chosen_filters(filters), "duration_s": duration}
        _warn_of_unused(entry, chosen)
        _run(entry, seed, chosen, out, figures=figures, json_wanted=json_wanted)

    return command


def study_help(catalogue: Mapping[str, StudyEntry]) -> str:
    """Return the help of the command: a summary, and a paragraph for each study."""
    first = (
        "Reproduce the tables and figures of the source papers: tables in the terminal, a report "
        "with plots in one HTML file."
    )
    studies = [
        f"[bold]{name}[/]: {entry.purpose} {_defaults_text(entry)}"
        for name, entry in catalogue.items()
    ]
    last = "Options that a study does not support are ignored with a warning."
    return "\n\n".join((first, *studies, last))


def _defaults_text(entry: StudyEntry) -> str:
    defaults = []
    if entry.runs is not None:
        defaults.append(f"--runs {entry.runs}")
    if entry.duration_s is not None:
        least, most = entry.duration_bounds_s
        defaults.append(f"--duration {entry.duration_s:g} ({least:g} to {most:g})")
    if entry.filters:
        defaults.append(f"--filters {','.join(entry.filters)}")
    return f"Options and defaults: {' '.join(defaults)}." if defaults else ""


def _run(
    entry: StudyEntry,
    seed: int,
    chosen: Mapping[str, object],
    out: Path | None,
    *,
    figures: Path | None,
    json_wanted: bool,
) -> None:
    from multiradar.research.studies.result import StudyOptions
    from multiradar.storage.output_file import free_name
    from multiradar.toolbox.studies import run_study

    if out is None and not json_wanted:
        out = free_name(Path(f"{entry.name}.html"))
    options = StudyOptions(seed=seed, **chosen)  # type: ignore[arg-type]
    try:
        result = run_study(entry, options, out, figures)
    except ArgumentError as error:
        raise typer.BadParameter(error.sentence_of(lambda name: FLAGS[name])) from error
    if json_wanted:
        from multiradar_schemas.rounding import rounded_members

        members = rounded_members(result.json_object())
        print(json.dumps(members, ensure_ascii=False, allow_nan=False))
        return
    _print_result(result)
    print(f"report written to {out}")
    if figures is not None:
        print(f"{len(result.plots)} figures written to {figures}, each as SVG and PDF")


def _print_result(result: "StudyResult") -> None:
    from rich.console import Console

    from multiradar.cli.terminal.report_tables import print_document
    from multiradar.research.studies.document import document_of

    width = None if sys.stdout.isatty() else WIDTH_UNKNOWN
    print_document(document_of(result), Console(highlight=False, markup=False, width=width))


def _warn_of_unused(entry: StudyEntry, chosen: Mapping[str, object]) -> None:
    unused = [
        FLAGS[name]
        for name, value in chosen.items()
        if value is not None and name not in entry.supported_options
    ]
    if unused:
        print(
            f"multiradar: {entry.name} does not support {', '.join(unused)}; ignored",
            file=sys.stderr,
        )


def _chosen_filters(text: str | None) -> tuple[str, ...] | None:
    # In the order given, each once.
    return None if text is None else tuple(dict.fromkeys(name.strip() for name in text.split(",")))


def _parse_runs(text: str) -> int:
    return _whole(text, 1, RUNS_MAX)


def _parse_seed(text: str) -> int:
    return _whole(text, 0, 2**63 - 1)


def _whole(text: str, least: int, most: int) -> int:
    try:
        number = int(text)
    except ValueError:
        number = least - 1
    if not least <= number <= most:
        msg = f"expected a whole number from {least} to {most}, was {text!r}"
        raise typer.BadParameter(msg)
    return number


def _parse_duration(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 < seconds <= DURATION_S_MAX:
        msg = f"expected a number of seconds above 0 and at most {DURATION_S_MAX:g}, was {text!r}"
        raise typer.BadParameter(msg)
    return seconds
