"""`multiradar convert`: recordings in other forms become measurements and tracks on disk."""

import ctypes
import datetime as dt
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from multiradar.cli.converting import bytes_bar, conversion_faults
from multiradar.cli.diagnoses import fail_when_badly_converted
from multiradar.cli.options import JsonOption
from multiradar.errors import ConfigurationError

if TYPE_CHECKING:
    from multiradar_converters.vid.options import Options

#: As `multiradar_converters.vid.options.TRACK_KINDS`, not imported here: help must be fast.
TRACK_KIND_CHOICES = ("ads", "multiradar", "monoradar", "plots")

#: Number of the parameter in glibc's malloc.h.
_M_ARENA_MAX = -8

_VID_HELP = (
    "Convert the text dump of a VID recording.\n\n"
    "DUMP is a folder with tracks.txt, plots.txt and plots_ads.txt. OUT is made: one folder for "
    "each aircraft (the dump's global) with ads, 240_mr, SOURCE_mr (tracks of one radar) and "
    "SOURCE_r (plots that these name) as .new4 and .plt.\n\n"
    "Beside them: measurements.parquet (every plot and every ADS-B row), sensors.toml (a skeleton, "
    "positions to be filled in), rejects.ndjson (every broken line) and report.json. The options "
    "choose what goes into the .new4 and .plt files; the table always holds everything."
)

convert_app = typer.Typer(
    name="convert",
    help="Turn recordings into measurements.parquet and files for each aircraft.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


@convert_app.callback()
def _convert() -> None:
    """Turn recordings into measurements.parquet and files for each aircraft."""


def parse_track_kinds(text: str) -> str:
    """Check a list of kinds of track files, separated by commas."""
    for kind in text.split(","):
        if kind.strip() not in TRACK_KIND_CHOICES:
            msg = f"expected kinds of {', '.join(TRACK_KIND_CHOICES)}, was {kind.strip()!r}"
            raise typer.BadParameter(msg)
    return text


def parse_date(text: str) -> str:
    """Check a date."""
    try:
        day = dt.datetime.strptime(text, "%Y-%m-%d").replace(tzinfo=dt.UTC)
    except ValueError as error:
        msg = f"expected a date such as 2018-08-01, was {text!r}"
        raise typer.BadParameter(msg) from error
    return day.date().isoformat()


@convert_app.command(name="vid", help=_VID_HELP)
def convert_vid(
    dump: Annotated[
        Path,
        typer.Argument(metavar="DUMP", help="The folder of the dump.", show_default=False),
    ],
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="The folder to make; it must not exist.", show_default=False
        ),
    ],
    *,
    aircraft_max: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Write at most so many aircraft, those with most ADS-B reports first. "
            "Old name: AZN_TRACKS_MAX.",
            show_default="all",
        ),
    ] = None,
    ads_measurements_min: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="N",
            help="Write only aircraft with at least so many ADS-B reports; 0 writes those without "
            "ADS-B too. Old name: AZN_TRACKS_MIN_MEASUR.",
        ),
    ] = 0,
    sensor_only: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="SENSOR",
            help="Use only plots and rows of radar tracks of this kind of sensor (10: secondary, "
            "1: primary). Old name: RADAR_SENSOR_ONLY.",
            show_default="all",
        ),
    ] = None,
    track_measurements_min: Annotated[
        int,
        typer.Option(
            min=1,
            metavar="N",
            help="Do not write a track with fewer measurements. Old name: TRACKS_MIN_MEASUR.",
        ),
    ] = 1,
    kinds: Annotated[
        str,
        typer.Option(
            metavar="KIND,KIND",
            help=f"Kinds of track files to write: {', '.join(TRACK_KIND_CHOICES)}.",
            parser=parse_track_kinds,
            show_default="all",
        ),
    ] = ",".join(TRACK_KIND_CHOICES),
    date: Annotated[
        str | None,
        typer.Option(
            metavar="YYYY-MM-DD",
            help="The day of the recording. With it, times in the table are Unix times; without "
            "it they stay times of day, and the .plt files count from 1970-01-01.",
            parser=parse_date,
            show_default=False,
        ),
    ] = None,
    profile: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="What the dump calls its files and columns, its units, separator, form of time.",
            show_default="the layout of docs/converter.md",
        ),
    ] = None,
    allow_missing: Annotated[
        bool,
        typer.Option(
            "--allow-missing", help="Do without tracks.txt or plots_ads.txt where it is missing."
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Convert the text dump of a VID recording."""
    from multiradar_converters.errors import ProfileError
    from multiradar_converters.vid.options import Options
    from multiradar_converters.vid.profile import load_profile

    try:
        options = Options(
            aircraft_max=aircraft_max,
            ads_measurements_min=ads_measurements_min,
            sensor_only=sensor_only,
            track_measurements_min=track_measurements_min,
            kinds=tuple(kind.strip() for kind in kinds.split(",")),
            date=None if date is None else dt.date.fromisoformat(date),
            profile=load_profile(profile),
            allow_missing=allow_missing,
        )
    except ProfileError as error:
        raise ConfigurationError(str(error)) from error
    report = convert_with_bar(dump, out, options)
    print(json.dumps(report, indent=1, ensure_ascii=False) if as_json else _summary(report, out))
    fail_when_badly_converted(report, out)


def convert_with_bar(dump: Path, out: Path, options: "Options") -> dict[str, Any]:
    """Convert a dump, with a progress bar on a terminal.

    Parameters
    ----------
    dump, out : Path
        Folder of the dump, and the folder to make.
    options : Options
        The user's choices.

    Returns
    -------
    dict
        What `report.json` says.

    Raises
    ------
    OutputExistsError
        `out` exists; nothing was touched.
    InputError
        The dump cannot be read; `out` does not exist.
    """
    _share_heap()
    from multiradar_converters.vid.conversion import PASSES, convert
    from multiradar_converters.vid.survey import dump_bytes

    with conversion_faults(), bytes_bar(PASSES * dump_bytes(dump, options)) as advance:
        return convert(dump, out, options, advance)


def _share_heap() -> None:
    """Let all threads of this process allocate from one heap, where the C library is glibc.

    With a heap for each thread a conversion holds 130 MiB more that nobody uses.
    """
    try:
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, 1)
    except (AttributeError, OSError, TypeError):
        # Another C library: nothing to tell it.
        return


def _summary(report: dict[str, Any], out: Path) -> str:
    counts, figures = report["counts"], report["figures"]
    lines = [
        f"read {counts['read']} lines: accepted {counts['accepted']}, "
        f"rejected {counts['rejected']}{_by_code(report)}; blank {counts['blank']}",
        f"{figures['aircraft']} aircraft; tracks written: "
        + (", ".join(f"{stem} {n}" for stem, n in figures["tracks_written"].items()) or "none"),
        f"plots that no track names: {figures['plots_named_by_no_track']}",
    ]
    if "note" in figures:
        lines.append(f"note: {figures['note']}")
    return "\n".join([*lines, f"wrote {out}"])


def _by_code(report: dict[str, Any]) -> str:
    """Name the codes of rejects, the commonest first."""
    codes = sorted(report["rejected_by_code"].items(), key=lambda item: (-item[1], item[0]))
    return f" ({', '.join(f'{code} {count}' for code, count in codes)})" if codes else ""
