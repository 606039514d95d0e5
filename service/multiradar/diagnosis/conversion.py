"""Diagnosis of a conversion, before sites are known: units, times, names.

A dump gives each plot the position computed by its own system. With ranges and azimuths in the
right units, all plots of a radar fit these positions from one site.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.agreement import Agreement, best_site, polar_agreement
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, TESTED_MAX, TESTED_MIN
from multiradar.diagnosis.cross_sensor.explanations import BEYOND_MAX, CIRCLE_MAX_RAD
from multiradar.diagnosis.cross_sensor.hypotheses import (
    AZIMUTH_UNITS,
    EXCHANGED,
    EXCHANGED_UNITS,
    MIRRORED,
    RANGE_UNITS,
    RARE_RANGE_UNITS,
    Polar,
    Reading,
    as_given,
)
from multiradar.diagnosis.cross_sensor.identities import check_identities
from multiradar.diagnosis.cross_sensor.plausibility import (
    RANGES_SMALL_M,
    aircraft_of,
    check_azimuth_unit,
    check_exchanged_columns,
    check_range_unit,
)
from multiradar.diagnosis.cross_sensor.references import recorded_pairs
from multiradar.diagnosis.dumps.cut_files import check_last_lines, check_truncation
from multiradar.diagnosis.dumps.lost_zeros import check_lost_zeros
from multiradar.diagnosis.dumps.references import check_references
from multiradar.diagnosis.dumps.tables import COLUMNS as TABLE_COLUMNS
from multiradar.diagnosis.dumps.tables import check_tables
from multiradar.diagnosis.evidence import (
    COLUMNS,
    GAP_MIN_S,
    GAPS_MAX,
    ROWS_MAX,
    Evidence,
    Source,
    count_before,
)
from multiradar.diagnosis.losses import LOST_MAX, READ_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.motion.reported_motion import COLUMNS as MOTION_COLUMNS
from multiradar.diagnosis.motion.reported_motion import (
    check_courses,
    check_reported_motion,
    legs_of,
)
from multiradar.diagnosis.motion.reports import check_reports
from multiradar.diagnosis.motion.vertical_rates import check_vertical_rates
from multiradar.diagnosis.names import check_names, counted
from multiradar.diagnosis.plots import Plots, Site, plots_of
from multiradar.diagnosis.same_aircraft.outages import check_gaps
from multiradar.diagnosis.same_aircraft.pauses import check_pauses
from multiradar.diagnosis.single_sensor.beams import check_azimuth_form
from multiradar.diagnosis.single_sensor.columns import SIGNED_MAX_DEG, SIGNED_MIN
from multiradar.diagnosis.single_sensor.height_units import check_height_unit
from multiradar.diagnosis.single_sensor.jumps import check_jumps
from multiradar.diagnosis.single_sensor.steps import (
    POSITION_SIGMA_M,
    check_rounded,
    check_wrapped,
)
from multiradar.diagnosis.times import TIME_UNIT, check_ends, check_times
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.longitudes import median_longitude
from multiradar_converters.vid.text.lines import BY_PROFILE
from multiradar_schemas.reject import RejectCode

_READINGS = (
    *RANGE_UNITS, *AZIMUTH_UNITS, EXCHANGED, *EXCHANGED_UNITS, MIRRORED, *RARE_RANGE_UNITS
)  # fmt: skip
#: The file of what was rejected, among the outputs of a report.
REJECTS_FILE = "rejects.ndjson"
#: Code of a file of which many records were rejected.
RECORDS_CODE = "records_rejected"
#: A recording of which a larger fraction of the octets is quarantined is not of a known form.
QUARANTINED_MAX = 0.5
#: Rejects that are read, and their reason for an azimuth of more than a full circle.
_REJECTS_MAX = 100_000
#: ... when they exceed this fraction of what was accepted: gradians lose a tenth.
_REJECTED_MIN = 0.02
_AZIMUTH_REASON = re.compile(r"azimuth: expected 0 to 360 °, was '(-?\d+\.?\d*)'")
#: Plots of a source of which this fraction are equal to others come from a file that was copied.
COPIES_MIN = 1.0 / 3.0
_MEASURED = ("time_s", "range_m", "azimuth_deg")
#: Fraction of the plots that fit their positions in the recording, at least.
_FITS_MIN = 0.2
_POSITIONS_DIFFER = "positions_differ"
#: Height of a radar whose site is not known, m.
_SITE_HEIGHT_M = 300.0


def diagnose_conversion(
    measurements: Path,
    report: Mapping[str, Any],
    sensors: SensorTable | None = None,
    tracks: pl.DataFrame | None = None,
) -> list[Diagnosis]:
    """Return the probable errors of a conversion.

    Parameters
    ----------
    measurements : Path
        The table of measurements that was written.
    report : mapping
        The report of the conversion.
    sensors : SensorTable, optional
        The sensors given for it.
    tracks : DataFrame, optional
        Of a dump: positions of some aircraft by its own tracks, columns of `check_tables`.

    Returns
    -------
    list of Diagnosis
        Empty when nothing is wrong.
    """
    cut = check_truncation(measurements, report) or check_last_lines(report)
    rejects = measurements.parent / REJECTS_FILE
    rejected = list(_rejected(report, rejects)) or check_lost_zeros(rejects)
    if any(BY_PROFILE in one.sentence for one in rejected):
        # The few values that remain fit other units by chance.
        return rejected
    found = [*rejected, *cut]
    sources = _sources(measurements)
    if not sources:
        # A recording of system tracks alone has none.
        written = any(one["rows"] for one in report["outputs"] if one["file"] != REJECTS_FILE)
        return found if found or written else [Diagnosis("", "no_measurements", _NOTHING)]
    if sensors is not None:
        evidence = Evidence(sensors, sources=sources)
        found += check_names(evidence)
    if not rejected:
        # A part of the rows has any times; those in another unit end early.
        times = [*check_times(sources), *check_gaps(sources)]
        if any(one.code == TIME_UNIT for one in times):
            found = []
        found += times
    # The check of the files names the truncated one.
    ends = [] if found else [*check_ends(sources), *check_pauses(sources)]
    found += [one for one in ends if one.severity == "error"]
    read = sum(source.read for source in sources.values())
    azimuths_deg = _rejected_azimuths(measurements.parent / REJECTS_FILE)
    found += _signed(azimuths_deg)
    largest_deg = _largest_rejected(azimuths_deg, read)
    for name, source in sources.items():
        rows = source.plots().filter(pl.col("kind") == "radar")
        if "files" in report.get("figures", {}):
            # A text dump; a recording of two networks has copies of its own.
            found += _copies(name, rows)
        found += _of_units(name, plots_of(rows), largest_deg)
        reports = plots_of(source.plots().filter(pl.col("kind").is_in(["adsb", "mlat"])))
        legs = legs_of(_motion(measurements, name))
        courses = check_courses(name, legs)
        found += (
            [one for one in courses if one.severity == "error"]
            or check_reported(name, reports)
            or check_reported_motion(name, legs)
            or courses
        )
    # The tables may show which positions are wrong.
    certain = [one for one in found if one.code != _POSITIONS_DIFFER]
    of_tables = _of_dump(measurements, report, sources, tracks, certain)
    found = [*(certain if of_tables else found), *of_tables]
    return [*found, *(one for one in ends if one not in found)]


def check_reported(name: str, reports: Plots) -> list[Diagnosis]:
    """Return the first error of a sensor that reports positions, by these alone.

    Parameters
    ----------
    name : str
        The sensor.
    reports : Plots
        Its reports.
    """
    found = (
        check_identities(name, reports, None)
        or check_rounded(name, reports, {"latitude_deg": POSITION_SIGMA_M}, configured=False)
        or check_reports(name, reports)
    )
    return [] if found is None else [found]


def check_plots(name: str, plots: Plots) -> list[Diagnosis]:
    """Return the first error of a radar that its plots show without its site.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots, with the positions that a recording gives them, if it does.
    """
    return _of_units(name, plots, 0.0)


# Reports with the motion that the aircraft report.
def _motion(measurements: Path, name: str) -> pl.DataFrame:
    scan = pl.scan_parquet(measurements)
    wanted = [*COLUMNS, *(one for one in MOTION_COLUMNS if one in scan.collect_schema().names())]
    chosen = pl.col("sensor_id").eq(name) & pl.col("kind").is_in(["adsb", "mlat"])
    return scan.filter(chosen).select(wanted).head(ROWS_MAX).collect()


# The tables of a dump against each other, where none is wrong by itself.
def _of_dump(
    measurements: Path,
    report: Mapping[str, Any],
    sources: Mapping[str, Source],
    tracks: pl.DataFrame | None,
    found: Sequence[Diagnosis],
) -> list[Diagnosis]:
    files = {one["table"]: name for name, one in _files(report).items() if "table" in one}
    if not files or found:
        return []
    numbers = sorted({name.rpartition("-")[0] for name in sources} - {""})
    missing = check_references(report, numbers)
    if tracks is None or tracks.is_empty() or any(one.severity == "error" for one in missing):
        return missing
    chosen = pl.col("track_number").is_in(tracks["track_number"].unique().to_list())
    rows = pl.scan_parquet(measurements).filter(chosen).select("kind", *TABLE_COLUMNS).collect()
    tables = {
        files[table]: rows.filter(kind=kind).select(TABLE_COLUMNS)
        for table, kind in (("plots", "radar"), ("plots_ads", "adsb"))
        if table in files
    }
    return [*missing, *check_tables(tables | {files["tracks"]: tracks})]


def _files(report: Mapping[str, Any]) -> Mapping[str, Any]:
    files: Mapping[str, Any] = report.get("figures", {}).get("files", {})
    return files


_NOTHING = (
    "no measurements were written: report.json counts the rejected and omitted records; check "
    "that the files are in the format that this command reads"
)


def _rejected(report: Mapping[str, Any], rejects: Path) -> Iterator[Diagnosis]:
    figures = report.get("figures", {})
    octets = figures.get("bytes", {})
    unknown = figures.get("unknown_editions", [])
    for source in unknown:
        yield Diagnosis("", "edition_unknown", source["reason"])
    doubtful = figures.get("doubtful_editions", [])
    for sentence in doubtful:
        yield Diagnosis("", "edition_wrong", sentence)
    # The messages above are for all of their blocks.
    for one in () if unknown or doubtful else report["inputs"]:
        read, rejected = one["counts"]["read"], one["counts"]["rejected"]
        # Copies, such as repeated positions of ADS-B, are not in another form.
        codes = _files(report).get(one["file"], {}).get("rejected_by_code", {})
        rejected -= codes.get(RejectCode.DUPLICATE, 0)
        if read >= READ_MIN and rejected > LOST_MAX * read:
            first = _first(rejects, one["file"])
            check = (
                "correct the unit in the profile"
                if BY_PROFILE in first
                else "check the file format, the order of the columns and the units"
            )
            yield Diagnosis(
                "",
                RECORDS_CODE,
                f"{one['file']}: {rejected / read:.0%} of its {counted(read)} records were "
                f"rejected{first}; rejects.ndjson gives the reason for each: {check}",
            )
        elif octets and octets[one["file"]]["quarantined"] > QUARANTINED_MAX * one["bytes"]:
            # Octets between damaged blocks are one reject, however many.
            yield Diagnosis(
                "",
                "octets_quarantined",
                f"{one['file']}: {octets[one['file']]['quarantined'] / one['bytes']:.0%} of its "
                f"{counted(one['bytes'])} octets could not be decoded; rejects.ndjson gives the "
                "reason for each: check the file format and the editions of its categories",
            )


# The most frequent reason of a file, without values, and its first line.
def _first(rejects: Path, file: str) -> str:
    if not rejects.is_file():
        return ""
    found: dict[str, tuple[int, str]] = {}
    with rejects.open(encoding="utf-8") as lines:
        for one in map(json.loads, islice(lines, _REJECTS_MAX)):
            if one.get("file") == file and "line" in one:
                reason = str(one["reason"])
                count, first = found.get(cause := reason.partition(", was ")[0], (0, ""))
                found[cause] = count + 1, first or f", such as line {one['line']}: {reason}"
    return max(found.values(), default=(0, ""))[1]


def _sources(measurements: Path) -> dict[str, Source]:
    scan = pl.scan_parquet(measurements)
    names = scan.select(pl.col("sensor_id").unique().sort()).collect()["sensor_id"].to_list()
    found = {}
    for name in names:
        rows = scan.filter(pl.col("sensor_id") == name)
        source = Source()
        source.add(rows.select(COLUMNS).head(ROWS_MAX).collect())
        time_s = pl.col("time_s")
        ends = rows.select(time_s.min().alias("first"), time_s.max().alias("last"), pl.len())
        source.first_s, source.last_s, source.read = ends.collect().row(0)
        _count_gaps(source, rows)
        found[str(name)] = source
    return found


# The longest gap, when it starts, and all of `GAP_MIN_S` or more.
def _count_gaps(source: Source, rows: pl.LazyFrame) -> None:
    times = rows.select(pl.col("time_s").sort()).collect()["time_s"].to_numpy()
    gaps = np.diff(times)
    if not len(gaps):
        return
    longest = np.argsort(-gaps, kind="stable")[:GAPS_MAX].tolist()
    source.gap_s, source.gap_from_s = float(gaps[longest[0]]), float(times[longest[0]])
    long = [one for one in longest if gaps[one] >= GAP_MIN_S]
    source.gaps = {float(times[one]): float(gaps[one]) for one in long}
    source.before = {float(times[one]): count_before(times, one) for one in long}


def _rejected_azimuths(file: Path) -> list[float]:
    if not file.is_file():
        return []
    with file.open(encoding="utf-8") as lines:
        found = (_AZIMUTH_REASON.search(line) for line in islice(lines, _REJECTS_MAX))
        return sorted(float(one[1]) for one in found if one is not None)


# The largest rejected azimuth but for some outliers; 0 unless so many were rejected that a part
# of each circle is missing.
def _largest_rejected(azimuths_deg: list[float], read: int) -> float:
    beyond = [one for one in azimuths_deg if one > 0.0]
    return beyond[-BEYOND_MAX - 1] if len(beyond) > _REJECTED_MIN * read + TESTED_MIN else 0.0


def _signed(azimuths_deg: list[float]) -> list[Diagnosis]:
    signed = [one for one in azimuths_deg if -180.0 <= one <= SIGNED_MAX_DEG]
    if len(signed) < SIGNED_MIN:
        return []
    return [
        Diagnosis(
            "",
            "azimuth_signed",
            f"{counted(len(signed))} azimuths between {signed[0]:.0f}° and 0° were rejected: "
            "azimuths must be 0 to 360° clockwise from north; add 360° to negative azimuths",
        )
    ]


def _copies(name: str, plots: pl.DataFrame) -> list[Diagnosis]:
    copies = plots.height - plots.n_unique(_MEASURED)
    if plots.height < TESTED_MIN or copies < COPIES_MIN * plots.height:
        return []
    return [
        Diagnosis(
            name,
            "rows_repeated",
            f"{name}: {copies / plots.height:.0%} of its plots are copies of other plots: a file "
            "was probably appended to itself; remove the copies (the tracker drops them, but the "
            "association of plots with tracks is lost)",
        )
    ]


def _of_units(name: str, plots: Plots, largest_deg: float) -> list[Diagnosis]:
    plots = plots.select(np.isfinite(plots.range_m) & np.isfinite(plots.azimuth_deg))
    if plots.size < TESTED_MIN:
        return []
    found = (
        check_exchanged_columns(name, plots)
        or check_azimuth_unit(name, plots)
        or check_azimuth_form(name, plots, np.nan)
        or check_wrapped(name, plots)
        or _against_positions(name, plots, largest_deg)
    )
    somewhere = (0.0, 0.0, _SITE_HEIGHT_M)
    if found is None and plots.range_m.max() <= RANGES_SMALL_M:
        found = check_range_unit(name, plots, somewhere, aircraft_of(plots), np.inf)
    found = found or check_height_unit(name, plots, somewhere)
    # Climbs are those of identities.
    found = found or check_jumps(name, plots, None)
    found = found or check_vertical_rates(name, plots.time_s, plots.height_m, aircraft_of(plots))
    return [] if found is None else [found]


# The interpretation of the columns with which all plots fit one site.
def _against_positions(name: str, plots: Plots, largest_deg: float) -> Diagnosis | None:
    plots = plots.thinned(TESTED_MAX)
    before, _ = _around_a_site(plots, as_given(plots.range_m, plots.azimuth_deg))
    if before.compared < TESTED_MIN or before.share >= AGREES_MIN:
        return None
    found: list[tuple[Reading, Agreement, Site]] = []
    for reading in _READINGS:
        _, largest = reading.polar(np.zeros(1), np.array([largest_deg]))
        if reading in AZIMUTH_UNITS and largest[0] > CIRCLE_MAX_RAD:
            continue
        agreement, site = _around_a_site(plots, reading.polar(plots.range_m, plots.azimuth_deg))
        # Similar units fit, too, where only a part of each circle was accepted.
        if agreement.share >= max([AGREES_MIN, *(1.1 * one.share for _, one, _ in found)]):
            found.append((reading, agreement, site))
    if found:
        return _of_reading(name, found[-1], before.share, largest_deg)
    if before.share >= _FITS_MIN:
        return None
    return Diagnosis(
        name,
        _POSITIONS_DIFFER,
        f"{name}: its ranges and azimuths do not fit the positions that the recording gives its "
        f"plots: only {before.share:.0%} of them do, for any site, and no other unit explains "
        "this; check the columns of ranges and azimuths, or leave the positions out",
    )


def _of_reading(
    name: str, found: tuple[Reading, Agreement, Site], before: float, largest_deg: float
) -> Diagnosis:
    reading, agreement, site = found
    latitude, longitude = np.degrees(site[:2])
    ends = ""
    if reading in AZIMUTH_UNITS and largest_deg:
        ends = f", with a maximum of {largest_deg:.0f}"
    return Diagnosis(
        name,
        reading.code,
        f"{name}: {reading.mistake}{ends}: with {reading.with_it.format(origin='north')}, "
        f"{agreement.share:.0%} of its plots match their positions in the recording for a "
        f"site near {latitude:.2f}, {longitude:.2f} ({before:.0%} as recorded); "
        f"{reading.remedy}",
    )


def _around_a_site(plots: Plots, measured: Polar) -> tuple[Agreement, Site]:
    pairs = recorded_pairs(plots)
    compared = len(np.unique(pairs.plot))
    middle = (
        float(np.radians(np.nanmedian(plots.latitude_deg))) if compared else 0.0,
        median_longitude(np.radians(plots.longitude_deg)) if compared else 0.0,
        _SITE_HEIGHT_M,
    )
    if not compared:
        return polar_agreement(measured, middle, pairs, compared=0), middle
    site = best_site(plots, measured, middle, pairs)
    return polar_agreement(measured, site, pairs, compared=compared), site
