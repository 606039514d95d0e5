"""`multiradar convert asterix`: measurements from ASTERIX recordings."""

import datetime as dt
import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from multiradar.cli.compiling import compile_kernels
from multiradar.cli.conversion.outcome import convert_files, records_line, times_line
from multiradar.cli.inputs import read_sensors
from multiradar.cli.options import JsonOption, ReferenceOption, parse_date, read_references
from multiradar.cli.terminal.diagnoses import fail_when_badly_converted
from multiradar.errors import InputError

#: Text of `--help`.
ASTERIX_HELP = (
    "Convert ASTERIX recordings.\n\n"
    "FILE is blocks back to back (.ast, .raw), a .gps, .rply or .ff (Final format) recording, or a "
    "network capture (.pcap, .pcapng); the format is detected. Several files form one recording, "
    "the earliest first.\n\n"
    "DIR is created: measurements.parquet (plots of categories 001, 010 and 048, "
    "multilateration of 010 and 020, ADS-B of 021), rejects.ndjson (every block that cannot be "
    "decoded), report.json (records by category, sensor and item) and sensors.toml (scan periods, "
    "ranges, and sites where they are reported)."
)


def convert_asterix(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Recordings.", show_default=False)
    ],
    *,
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Output directory; must not exist.", show_default=False),
    ],
    sensors: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="sensors.toml: assigns sensor ids to SAC and SIC.",
            show_default="SAC-SIC",
        ),
    ] = None,
    date: Annotated[
        str | None,
        typer.Option(
            metavar="YYYY-MM-DD",
            help="Date on which the recording starts. With it, times are Unix times; without it, "
            "times of day, counted on past midnight.",
            parser=parse_date,
            show_default=False,
        ),
    ] = None,
    edition: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[SAC-SIC/]CATEGORY=EDITION",
            help="Edition of a category, such as 021=0.26 or 20-130/048=1.15; repeatable.",
            show_default="the newest that fits",
        ),
    ] = None,
    reference: ReferenceOption = None,
    all_targets: Annotated[
        bool,
        typer.Option(
            "--all-targets",
            help="Include test targets, simulated targets, fixed transponders and reports without "
            "a detection; see the column flags.",
        ),
    ] = False,
    records: Annotated[
        bool,
        typer.Option(
            "--records",
            help="Also write records.ndjson: every field of every record, with its unit.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Convert ASTERIX recordings."""
    from multiradar_converters.asterix.conversion import convert
    from multiradar_converters.asterix.decoding.editions import parse_editions
    from multiradar_converters.asterix.options import Options
    from multiradar_converters.errors import ProfileError

    try:
        editions = parse_editions(edition or [])
    except ProfileError as error:
        raise typer.BadParameter(str(error), param_hint="--edition") from error
    options = Options(
        sensors=None if sensors is None else read_sensors(sensors),
        date=None if date is None else dt.date.fromisoformat(date),
        editions=editions,
        all_targets=all_targets,
        records=records,
        references=read_references(reference),
    )
    compile_kernels(["convert asterix"])
    report = convert_files(files, lambda advance: convert(files, out, options, advance))
    print(json.dumps(report, indent=1, ensure_ascii=False) if as_json else _summary(report, out))
    _print_alarms(report)
    _fail_when_truncated(report, out)
    _fail_without_reference_point(report, out)
    _fail_with_unused_options(report, out)
    fail_when_badly_converted(report, out, options.sensors)


def _fail_when_truncated(report: dict[str, Any], out: Path) -> None:
    # The amount of missing data is unknown; what was read is kept.
    cut = [f"{file}: {reason}" for file, reason in report["figures"]["cut_short"].items()]
    if cut:
        msg = f"{'; '.join(cut)}; probably cut while copying, what was read is in {out}"
        raise InputError(msg)


def _fail_without_reference_point(report: dict[str, Any], out: Path) -> None:
    missing: dict[str, int] = report["figures"]["unreferenced"]
    if missing:
        counts = ", ".join(f"{count:,} reports of {name}" for name, count in missing.items())
        first = next(iter(missing))
        msg = (
            f"{counts} have local coordinates only, and their reference point is not known; give "
            f"it by --reference {first}=LATITUDE,LONGITUDE, or as latitude_deg and longitude_deg "
            f"of the sensor in --sensors; {out} has the other reports"
        )
        raise InputError(msg)


# An option for a source that is not in the recording is a misspelt one.
def _fail_with_unused_options(report: dict[str, Any], out: Path) -> None:
    records: dict[str, dict[str, int]] = report["figures"]["records_by_sensor"]
    sources = {name for of_category in records.values() for name in of_category}
    unused = [
        f"--edition {name}={edition}"
        for name, edition in report["settings"]["editions"].items()
        if not _is_recorded(name, records)
    ]
    unused += [
        f"--reference {name}" for name in report["settings"]["references"] if name not in sources
    ]
    if unused:
        recorded = "; ".join(f"{one} of {', '.join(of)}" for one, of in records.items())
        msg = (
            f"{', '.join(unused)}: not in the recording, which has "
            f"{recorded}; correct "
            f"the option, or omit it; {out} was written without it"
        )
        raise InputError(msg)


def _is_recorded(name: str, records: dict[str, dict[str, int]]) -> bool:
    source, _, category = name.rpartition("/")
    return category in records and (not source or source in records[category])


def _summary(report: dict[str, Any], out: Path) -> str:
    figures = report["figures"]
    left = ", ".join(f"{name} {count}" for name, count in figures["left_out"].items() if count)
    return "\n".join(
        [
            records_line(report),
            "records by category: "
            + (", ".join(f"{name} {n}" for name, n in figures["records"].items()) or "none"),
            f"measurements: {report['outputs'][0]['rows']} of {len(figures['measurements'])} "
            f"sensors; left out: {left or 'none'}",
            *(
                f"updates of system tracks: {output['rows']} (for `evaluate --system-tracks`)"
                for output in report["outputs"]
                if output["file"] == "system_tracks.parquet"
            ),
            *_reported_lines(figures["reported_biases"]),
            times_line(figures["first_s"], figures["last_s"]),
            *_clock_lines(figures),
            f"wrote {out}",
        ]
    )


def _reported_lines(reported: list[dict[str, Any]]) -> list[str]:
    """Return the biases that another processor reports, a line for each radar."""
    lines: dict[tuple[str, str], list[str]] = {}
    for one in reported:
        own = lines.setdefault((one["sensor_id"], one["processor_id"]), [])
        own.append(f"{one['parameter']} {one['estimate']:+.4g}")
    found = [
        f"  {sensor}: {', '.join(texts)} (by {processor})"
        for (sensor, processor), texts in lines.items()
    ]
    head = "biases reported by another processor (priors in sensors.toml):"
    return [head, *found] if found else []


def _clock_lines(figures: dict[str, Any]) -> list[str]:
    clocks = figures["clocks"].values()
    if not clocks:
        return []
    offsets = [one["clock_offset_s"] for one in clocks]
    medians = [m for one in clocks if (m := one["latency_median_s"]) is not None]
    latency = f"latency {_span(medians)} (medians), " if medians else ""
    lines = [
        f"reception: {latency}clock offset {_span(offsets, '+')} (with the fastest messages) of "
        f"{len(offsets)} sensors; report.json gives each"
    ]
    if figures["receiver_zone_s"]:
        zone_h = figures["receiver_zone_s"] / 3600.0
        lines.append(f"times of reception are probably local, {zone_h:+g} h from UTC")
    return lines


def _span(values: list[float], sign: str = "") -> str:
    first, last = f"{min(values):{sign}.2f}", f"{max(values):{sign}.2f}"
    return f"{first} s" if first == last else f"{first} to {last} s"


def _print_alarms(report: dict[str, Any]) -> None:
    # A warning: the conversion itself is complete, whichever clock is wrong.
    for alarm in report["figures"]["sensor_alarms"]:
        print(f"multiradar: {alarm['sensor_id']}: {alarm['reason']}", file=sys.stderr)
