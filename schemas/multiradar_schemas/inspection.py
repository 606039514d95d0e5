"""What recordings contain, as `multiradar inspect --json` prints it."""

from typing import Annotated, Any

from multiradar_schemas.base import Record, described
from multiradar_schemas.report import Count, Counts

_TIME_UNIT = "s"


def _number(description: str, unit: str, absent: str = "never") -> Any:
    return described(description, unit=unit, source="recording", absent=absent)


def _text(description: str, absent: str = "never") -> Any:
    return described(description, unit="text", source="recording", absent=absent)


class InspectedFile(Record):
    """A file of a recording."""

    file: Annotated[str, _text("Name of the file")]
    form: Annotated[str, _text("Format of the file, such as `gps`, `capture` or `text: plots`")]
    bytes: Annotated[Count, _number("Size of the file", "byte")]
    read: Annotated[Count, _number("Number of records and unreadable parts", "1")]
    rejected: Annotated[
        Count, _number("Number of these that cannot be decoded or are implausible", "1")
    ]
    quarantined_bytes: Annotated[
        Count | None,
        _number("Number of octets that do not belong to a record", "byte", "the format is text"),
    ] = None


class InspectedRejects(Record):
    """Rejected records with the same reason."""

    file: Annotated[str, _text("The file")]
    code: Annotated[str, _text("Code of the reason")]
    reason: Annotated[str, _text("The reason")]
    count: Annotated[Count, _number("Number of rejected records", "1")]


class InspectedCategory(Record):
    """Records of an ASTERIX category of a sensor."""

    category: Annotated[str, _text("Category, three digits")]
    sensor: Annotated[str, _text("`SAC-SIC`")]
    edition: Annotated[str, _text("Latest edition that matches the records; empty if unknown")]
    records: Annotated[Count, _number("Number of records", "1")]


class InspectedGap(Record):
    """A period without reports of a sensor."""

    first_s: Annotated[float, _number("Start of the gap", _TIME_UNIT)]
    duration_s: Annotated[float, _number("Duration of the gap", _TIME_UNIT)]


class InspectedSite(Record):
    """Position of a sensor."""

    latitude_deg: Annotated[float, _number("Latitude, WGS 84", "degree")]
    longitude_deg: Annotated[float, _number("Longitude, WGS 84", "degree")]
    height_m: Annotated[float, _number("Height of the antenna", "m")]
    sigma_m: Annotated[
        float | None,
        _number("Standard deviation on each axis", "m", "the position was not estimated"),
    ] = None
    source: Annotated[str, _text("Source of the position")]


class InspectedClock(Record):
    """Times of a sensor and of their reception, as in `report.json` of a conversion."""

    clock_offset_s: Annotated[
        float,
        _number("Times of the fastest messages minus their times of reception", _TIME_UNIT),
    ]
    latency_min_s: Annotated[
        float | None,
        _number(
            "First percentile of the latency: time of reception minus time of the report",
            _TIME_UNIT,
            "no reports",
        ),
    ]
    latency_median_s: Annotated[
        float | None, _number("Median of the latency", _TIME_UNIT, "no reports")
    ]
    latency_p99_s: Annotated[
        float | None, _number("99th percentile of the latency", _TIME_UNIT, "no reports")
    ]
    alarm: Annotated[str | None, _text("`clock` or `latency`", "the times are plausible")] = None
    reason: Annotated[
        str | None, _text("Human-readable description of the alarm", "the times are plausible")
    ] = None


class InspectedQuantity(Record):
    """A quantity of aircraft-derived data of a sensor."""

    reports: Annotated[Count, _number("Number of measurements with this quantity", "1")]
    sigma: Annotated[
        float | None,
        _number("Report-to-report noise, 1 sigma", "as the column", "too few reports"),
    ]


class InspectedData(Record):
    """Aircraft-derived data of a sensor."""

    with_data: Annotated[Count, _number("Number of measurements with any of these quantities", "1")]
    values: Annotated[
        dict[str, InspectedQuantity], _number("Quantities by the name of their column", "figures")
    ]
    dropped: Annotated[
        dict[str, Count], _number("Number of measurements with implausible values, by reason", "1")
    ]
    magnetic_variation_deg: Annotated[
        float | None,
        _number(
            "Magnetic variation for which the winds derived from all aircraft agree, positive to "
            "the east",
            "degree",
            "too few headings, or all in one direction",
        ),
    ]


class InspectedSensor(Record):
    """Reports of a sensor; fractions are of its measurements, unless described otherwise."""

    sensor_id: Annotated[str, _text("Name of the sensor, as in the conversion")]
    kind: Annotated[str, _text("radar, mlat or adsb")]
    reports: Annotated[Count, _number("Number of target reports", "1")]
    measurements: Annotated[
        Count, _number("Number of aircraft reports used for these figures", "1")
    ]
    duplicates: Annotated[
        Count, _number("Number of reports that repeat another report within 1 s", "1")
    ]
    left_out: Annotated[
        dict[str, Count],
        _number("Number of reports that are not measurements of aircraft, by reason", "1"),
    ]
    first_s: Annotated[
        float | None, _number("Time of the first report", _TIME_UNIT, "no report has a time")
    ]
    last_s: Annotated[
        float | None, _number("Time of the last report", _TIME_UNIT, "no report has a time")
    ]
    mean_per_s: Annotated[float | None, _number("Mean rate of reports", "1/s", "no times")]
    max_per_s: Annotated[
        float | None, _number("Maximum number of reports in one second", "1/s", "no times")
    ]
    gaps: Annotated[Count, _number("Number of periods without reports", "1")]
    longest_gaps: Annotated[
        list[InspectedGap], _number("The longest gaps, in chronological order", "gaps")
    ]
    scan_period_s: Annotated[
        float | None, _number("Scan period", _TIME_UNIT, "not a radar, or no rotation found")
    ]
    scan_period_source: Annotated[
        str,
        _text(
            "Source of the scan period, or the reason why there is none; empty for sensors other "
            "than radars"
        ),
    ]
    range_min_m: Annotated[float | None, _number("Minimum slant range", "m", "no ranges")]
    range_max_m: Annotated[float | None, _number("Maximum slant range", "m", "no ranges")]
    empty_sectors_deg: Annotated[
        list[int], _number("Start azimuths of the 10° sectors without plots, clockwise", "degree")
    ]
    height_min_m: Annotated[float | None, _number("Minimum height", "m", "no heights")]
    height_median_m: Annotated[float | None, _number("Median height", "m", "no heights")]
    height_max_m: Annotated[float | None, _number("Maximum height", "m", "no heights")]
    aircraft: Annotated[
        Count,
        _number(
            "Number of distinct Mode S addresses, or of Mode 3/A codes if there are no addresses",
            "1",
        ),
    ]
    located_fraction: Annotated[
        float | None,
        _number("Fraction of the reports with a position", "1", "no reports"),
    ]
    local_fraction: Annotated[
        float | None,
        _number(
            "Fraction of the reports with local coordinates only (010/042, 020/042)",
            "1",
            "no such reports",
        ),
    ]
    mode_s_fraction: Annotated[
        float | None,
        _number("Fraction of the measurements with a Mode S address", "1", "no measurements"),
    ]
    mode_3a_fraction: Annotated[
        float | None,
        _number("Fraction of the measurements with a Mode 3/A code", "1", "no measurements"),
    ]
    height_fraction: Annotated[
        float | None, _number("Fraction of the measurements with a height", "1", "no measurements")
    ]
    on_ground_fraction: Annotated[
        float | None, _number("Fraction of the measurements on the ground", "1", "no measurements")
    ]
    registers: Annotated[
        dict[str, Count],
        _number(
            "Number of reports with each BDS register, such as `4,0`; `any`: with at least one "
            "register",
            "1",
        ),
    ]
    aircraft_data: Annotated[
        InspectedData | None,
        _number("Aircraft-derived data", "figures", "no such data"),
    ] = None
    clock: Annotated[
        InspectedClock | None, _number("Clock of the sensor", "clock", "no reception times")
    ] = None
    site: Annotated[
        InspectedSite | None, _number("Position of the sensor", "site", "not known")
    ] = None


class InspectedBias(Record):
    """A bias of a radar as another processor reports it in category 063."""

    processor_id: Annotated[str, _text("`SAC-SIC` of the processor")]
    sensor_id: Annotated[str, _text("`SAC-SIC` of the radar")]
    parameter: Annotated[
        str, _text("As in `biases.parquet`; with the prefix `psr_` for primary plots")
    ]
    reports: Annotated[Count, _number("Number of reports", "1")]
    estimate: Annotated[
        float, _number("The last reported value, measured minus true", "m, degree, 1 or s")
    ]
    spread: Annotated[
        float,
        _number("RMS difference between all reported values and the last value", "as `estimate`"),
    ]
    prior_sigma: Annotated[
        float | None,
        _number(
            "Sigma to use if the bias is adopted as a prior",
            "as `estimate`",
            "a parameter of primary plots",
        ),
    ]


class Inspection(Record):
    """What recordings contain."""

    version: Annotated[str, described("Version of the program", unit="text", source="run")]
    counts: Annotated[Counts, _number("Sum over all files", "counts")]
    files: Annotated[list[InspectedFile], _number("The files", "files")]
    rejects: Annotated[list[InspectedRejects], _number("Rejected records, by reason", "rejects")]
    categories: Annotated[
        list[InspectedCategory], _number("ASTERIX records by category and sensor", "categories")
    ]
    unknown_editions: Annotated[
        list[str], _text("Sources whose records match no known edition, with the reason")
    ]
    moved_files: Annotated[
        list[str],
        _text(
            "Files placed on a later day than another file of the same hours, or on the first of "
            "several possible days, with the reason"
        ),
    ]
    first_s: Annotated[float | None, _number("Time of the first report", _TIME_UNIT, "no times")]
    last_s: Annotated[float | None, _number("Time of the last report", _TIME_UNIT, "no times")]
    date: Annotated[
        str | None,
        _text("First day according to the recorder's clock", "the recorder stores no date"),
    ]
    sampled_fraction: Annotated[
        float,
        _number(
            "Fraction of the octets from which `measurements` and the following fields are "
            "computed",
            "1",
        ),
    ]
    system_tracks: Annotated[
        Count, _number("Number of system track updates from another tracker", "1")
    ]
    reported_biases: Annotated[
        list[InspectedBias], _number("Biases reported by another tracker (063)", "biases")
    ]
    sensors: Annotated[list[InspectedSensor], _number("The sensors", "sensors")]
    sensors_toml: Annotated[str, _text("Suggested `sensors.toml`")]
