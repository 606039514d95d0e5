"""`multiradar convert`: measurements and track files from recordings in other formats."""

from pathlib import Path
from typing import Annotated, Any

import typer

from multiradar.cli.conversion.outcome import print_conversion, times_line
from multiradar.cli.options import JsonOption, parse_date
from multiradar_schemas.documents.names import unknown

#: As `multiradar_converters.vid.options.TRACK_KINDS`, not imported here: help must be fast.
TRACK_KIND_CHOICES = ("ads", "multiradar", "monoradar", "plots")

_VID_HELP = (
    "Convert the text dump of a VID recording.\n\n"
    "DUMP is a directory with tracks.txt, plots.txt and plots_ads.txt. Creates OUT with one "
    "directory per aircraft (named after its global number in the dump), which contains ads, "
    "240_mr, SOURCE_mr (tracks of one radar) and SOURCE_r (the plots these tracks refer to) as "
    ".new4 and .plt files.\n\n"
    "It also writes measurements.parquet (every plot and every ADS-B row), sensors.toml (a "
    "template with measured scan periods and ranges; fill in the site coordinates), "
    "rejects.ndjson (every rejected line) and report.json. The options select what goes into the "
    ".new4 and .plt files; measurements.parquet always contains everything."
)

convert_app = typer.Typer(
    name="convert",
    help="Convert recordings to measurements.parquet and track files.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


@convert_app.callback()
def _convert() -> None:
    """Convert recordings to measurements.parquet and track files."""


def parse_track_kinds(text: str) -> str:
    """Check a list of kinds of track files, separated by commas."""
    for kind in text.split(","):
        if kind.strip() not in TRACK_KIND_CHOICES:
            raise typer.BadParameter(unknown("kind", kind.strip(), TRACK_KIND_CHOICES))
    return text


@convert_app.command(name="vid", help=_VID_HELP)
def convert_vid(
    dump: Annotated[
        Path,
        typer.Argument(metavar="DUMP", help="Dump directory.", show_default=False),
    ],
    out: Annotated[
        Path,
        typer.Argument(metavar="OUT", help="Output directory; must not exist.", show_default=False),
    ],
    *,
    aircraft_max: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Maximum number of aircraft, those with the most ADS-B reports first. "
            "Old name: AZN_TRACKS_MAX.",
            show_default="all",
        ),
    ] = None,
    ads_measurements_min: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="N",
            help="Minimum number of ADS-B reports of an aircraft; 0 includes those without ADS-B. "
            "Old name: AZN_TRACKS_MIN_MEASUR.",
        ),
    ] = 0,
    sensor_only: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="SENSOR",
            help="Use only plots and radar tracks of this sensor type (10: secondary, 1: "
            "primary). Old name: RADAR_SENSOR_ONLY.",
            show_default="all",
        ),
    ] = None,
    track_measurements_min: Annotated[
        int,
        typer.Option(
            min=1,
            metavar="N",
            help="Minimum number of measurements of a track. Old name: TRACKS_MIN_MEASUR.",
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
            help="Date of the recording. If given, times in measurements.parquet become Unix "
            "times; otherwise they remain times of day, and the .plt files start on 1970-01-01.",
            parser=parse_date,
            show_default=False,
        ),
    ] = None,
    profile: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Layout of the dump: file and column names, units, separator, time format.",
            show_default="the layout of docs/howto/converter.md",
        ),
    ] = None,
    allow_missing: Annotated[
        bool,
        typer.Option("--allow-missing", help="Accept dumps without tracks.txt or plots_ads.txt."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Convert the text dump of a VID recording."""
    from multiradar.toolbox.conversion.convert import convert

    print_conversion(
        lambda: convert(
            dump,
            out=out,
            format="vid",
            aircraft_max=aircraft_max,
            ads_measurements_min=ads_measurements_min,
            sensor_only=sensor_only,
            track_measurements_min=track_measurements_min,
            kinds=[kind.strip() for kind in kinds.split(",")],
            date=date,
            profile=profile,
            allow_missing=allow_missing,
        ),
        _summary,
        as_json=as_json,
    )


def _summary(report: dict[str, Any], out: Path) -> str:
    counts, figures = report["counts"], report["figures"]
    lines = [
        f"read {counts['read']} lines: accepted {counts['accepted']}, "
        f"rejected {counts['rejected']}{_by_code(report)}; blank {counts['blank']}",
        f"{figures['aircraft']} aircraft; tracks written: "
        + (", ".join(f"{stem} {n}" for stem, n in figures["tracks_written"].items()) or "none"),
        f"plots not referenced by any track: {figures['plots_named_by_no_track']}",
        times_line(figures["first_s"], figures["last_s"]),
    ]
    if "note" in figures:
        lines.append(f"note: {figures['note']}")
    return "\n".join([*lines, f"wrote {out}"])


def _by_code(report: dict[str, Any]) -> str:
    """Return the counts by reject code as text, the most frequent first."""
    codes = sorted(report["rejected_by_code"].items(), key=lambda item: (-item[1], item[0]))
    return f" ({', '.join(f'{code} {count}' for code, count in codes)})" if codes else ""
