"""`multiradar convert adsb`: measurements from recorded ADS-B trajectories."""

from pathlib import Path
from typing import Annotated, Any

import typer

from multiradar.cli.conversion.outcome import print_conversion, records_line, times_line
from multiradar.cli.options import JsonOption, parse_date

#: Text of `--help`.
ADSB_HELP = (
    "Convert ADS-B trajectories.\n\n"
    "FILE is JSON (a list of records, one record per line, or columns), CSV with the same "
    "columns, a readsb or tar1090 trace, or a recorded feed: JSON lines or aircraft.json from "
    "readsb or dump1090, BaseStation (port 30003), or CSV from mlat-server; plain or "
    "gzip-compressed. The format is detected automatically. Columns are identified by name: "
    "timestamp, latitude, longitude, icao24 and altitude, or the names used by OpenSky and "
    "readsb.\n\n"
    "Creates DIR with measurements.parquet, rejects.ndjson (every rejected record), report.json "
    "and sensors.toml (a template)."
)


def convert_adsb(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Trajectories.", show_default=False)
    ],
    *,
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Output directory; must not exist.", show_default=False),
    ],
    date: Annotated[
        str | None,
        typer.Option(
            metavar="YYYY-MM-DD",
            help="Date of the first record with a time of day only. If given, such times become "
            "Unix times; otherwise they remain times of day that keep increasing past midnight.",
            parser=parse_date,
            show_default=False,
        ),
    ] = None,
    utc_offset: Annotated[
        float,
        typer.Option(
            metavar="H",
            min=-14.0,
            max=14.0,
            help="Local time of BaseStation messages minus UTC, hours; all other formats use UTC.",
        ),
    ] = 0.0,
    as_json: JsonOption = False,
) -> None:
    """Convert ADS-B trajectories."""
    from multiradar.toolbox.conversion.convert import convert

    print_conversion(
        lambda: convert(files, out=out, format="adsb", date=date, utc_offset=utc_offset),
        _summary,
        as_json=as_json,
    )


def _summary(report: dict[str, Any], out: Path) -> str:
    figures = report["figures"]
    others = [
        account["without_position"]
        for account in figures["files"].values()
        if "without_position" in account
    ]
    heard = f"; messages without a position: {sum(others)}" if others else ""
    return "\n".join(
        [
            f"{records_line(report)}; blank {report['counts']['blank']}{heard}",
            f"{figures['aircraft']} aircraft; stale positions: {figures['stale']}, "
            f"repeated: {figures['repeated']}, jumps: {figures['jumps']}, times stepping back: "
            f"{figures['backwards']}",
            times_line(figures["first_s"], figures["last_s"]),
            f"wrote {out}",
        ]
    )
