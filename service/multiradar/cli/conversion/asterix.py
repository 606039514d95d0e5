"""`multiradar convert asterix`: measurements from ASTERIX recordings."""

from pathlib import Path
from typing import Annotated, Any

import typer

from multiradar.cli.conversion.outcome import print_conversion, records_line, times_line
from multiradar.cli.options import JsonOption, ReferenceOption, parse_date

#: Text of `--help`.
ASTERIX_HELP = (
    "Convert ASTERIX recordings.\n\n"
    "FILE contains consecutive ASTERIX data blocks (.ast, .raw), or is a .gps, .rply or .ff (Final "
    "format) recording, or a network capture (.pcap, .pcapng); the format is detected "
    "automatically. Several files, given in chronological order, form one recording.\n\n"
    "Creates DIR with measurements.parquet (plots of categories 001, 010 and 048, "
    "multilateration of 010 and 020, ADS-B of 021), rejects.ndjson (every data block that cannot "
    "be decoded), report.json (records by category, sensor and item) and sensors.toml (scan "
    "periods, ranges, and sites if they are reported)."
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
            help="Date on which the recording starts. If given, times become Unix times; "
            "otherwise they remain times of day that keep increasing past midnight.",
            parser=parse_date,
            show_default=False,
        ),
    ] = None,
    edition: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[SAC-SIC/]CATEGORY=EDITION",
            help="Edition of a category, such as 021=0.26 or 20-130/048=1.15; repeatable.",
            show_default="the newest that decodes the recording",
        ),
    ] = None,
    reference: ReferenceOption = None,
    all_targets: Annotated[
        bool,
        typer.Option(
            "--all-targets",
            help="Include test targets, simulated targets, fixed transponders and reports without "
            "a detection; see the column `flags`.",
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
    from multiradar.toolbox.conversion.convert import convert

    print_conversion(
        lambda: convert(
            files,
            out=out,
            format="asterix",
            sensors=sensors,
            date=date,
            edition=edition or (),
            reference=reference or (),
            all_targets=all_targets,
            records=records,
        ),
        _summary,
        as_json=as_json,
    )


def _summary(report: dict[str, Any], out: Path) -> str:
    figures = report["figures"]
    left = ", ".join(f"{name} {count}" for name, count in figures["left_out"].items() if count)
    return "\n".join(
        [
            records_line(report),
            "records by category: "
            + (", ".join(f"{name} {n}" for name, n in figures["records"].items()) or "none"),
            f"measurements: {report['outputs'][0]['rows']} from {len(figures['measurements'])} "
            f"sensors; omitted: {left or 'none'}",
            *(
                f"system track updates: {output['rows']} (for `evaluate --system-tracks`)"
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
        f"reception: {latency}clock offset {_span(offsets, '+')} (from the fastest messages) for "
        f"{len(offsets)} sensors; see report.json for each sensor"
    ]
    if figures["receiver_zone_s"]:
        zone_h = figures["receiver_zone_s"] / 3600.0
        lines.append(f"reception times are probably in local time, UTC {zone_h:+g} h")
    return lines


def _span(values: list[float], sign: str = "") -> str:
    first, last = f"{min(values):{sign}.2f}", f"{max(values):{sign}.2f}"
    return f"{first} s" if first == last else f"{first} to {last} s"
