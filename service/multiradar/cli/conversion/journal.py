"""`multiradar convert journal`: measurements that a service has received."""

from pathlib import Path
from typing import Annotated, Any

import typer

from multiradar.cli.conversion.outcome import print_conversion, records_line, times_line
from multiradar.cli.options import JsonOption, parse_time

#: Text of `--help`.
JOURNAL_HELP = (
    "Convert the measurements that a service has received.\n\n"
    "SOURCE is the state directory of a service, which may be running, a backup, or an archive. "
    "The output can be used with track, replay, align and view. With the sensors file and settings "
    "of the service, track reproduces its tracks and biases.\n\n"
    "With --recover, rejected measurements are included, such as those of a sensor that was "
    "not yet configured in the service; all measurements are then sorted by time.\n\n"
    "Creates DIR with measurements.parquet, rejects.ndjson and report.json."
)


def convert_journal(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE", help="State directory, backup or archive.", show_default=False
        ),
    ],
    *,
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Output directory; must not exist.", show_default=False),
    ],
    recover: Annotated[
        str | None,
        typer.Option(
            metavar="CODE,CODE",
            help="Include measurements that were rejected with these codes: UNKNOWN_SENSOR, "
            "SENSOR_DISABLED, TIME_LATE, TIME_FUTURE, RATE_EXCEEDED.",
            show_default="none",
        ),
    ] = None,
    from_time: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="TIME",
            help="Start of the period (inclusive), such as 2026-01-31T12:00:00Z, or Unix seconds.",
            parser=parse_time,
            show_default="first measurement",
        ),
    ] = None,
    until: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="End of the period (exclusive).",
            parser=parse_time,
            show_default="last measurement",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Convert the measurements that a service has received."""
    from multiradar.toolbox.conversion.convert import ConvertOptions, convert

    options = ConvertOptions()
    if recover is not None:
        options["recover"] = [code.strip() for code in recover.split(",")]
    if from_time is not None:
        options["from_s"] = float(from_time)
    if until is not None:
        options["until_s"] = float(until)
    print_conversion(
        lambda: convert(source, out=out, format="journal", **options), _summary, as_json=as_json
    )


def _summary(report: dict[str, Any], out: Path) -> str:
    figures = report["figures"]
    recovered = ", ".join(f"{code} {n}" for code, n in figures["recovered_by_code"].items())
    included = f"; recovered: {recovered}" if report["settings"]["recovered"] else ""
    outside = f"; outside the period: {figures['outside']}" if figures["outside"] else ""
    return "\n".join(
        [
            f"entries {figures['first_entry']} to {figures['last_entry']}",
            f"{records_line(report)}{included or ''}{outside}",
            times_line(figures["first_s"], figures["last_s"]),
            f"wrote {out}",
        ]
    )
