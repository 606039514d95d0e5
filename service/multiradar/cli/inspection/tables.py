"""The tables and notes of an inspection, for the terminal and the HTML page."""

from collections.abc import Sequence

from multiradar.report.content import Document, Plot, Table, Value
from multiradar.report.times import clock_text, day_text, is_dated, time_text
from multiradar_schemas.inspection import InspectedQuantity, InspectedSensor, Inspection

_KILOMETRE_M = 1000.0
_REGISTERS = ("4,0", "5,0", "6,0")
_SECTOR_DEG = 10
#: Intervals of azimuth in a cell.
_INTERVALS_MAX = 2
#: Rows of the table of rejects.
_REJECTS_MAX = 20


def inspection_document(found: Inspection, command: str, plots: Sequence[Plot] = ()) -> Document:
    """Return an inspection as a report.

    Parameters
    ----------
    found : Inspection
        What the recordings contain.
    command : str
        The command line.
    plots : sequence of Plot
        Plots of the page.

    Returns
    -------
    Document
        Tables without rows are omitted.
    """
    tables = (
        _sensors(found),
        _identity(found),
        _coverage(found),
        _files(found),
        _categories(found),
        _registers(found),
        _aircraft_data(found),
        _clocks(found),
        _gaps(found),
        _sites(found),
        _reported(found),
        _rejects(found),
    )
    return Document(
        title=f"Recording: {', '.join(one.file for one in found.files)}",
        summary=_summary(found),
        command=command,
        tables=[table for table in tables if table.rows],
        plots=plots,
        notes=_notes(found),
    )


def _summary(found: Inspection) -> str:
    counts = found.counts
    text = (
        f"read {counts.read:,} records: accepted {counts.accepted:,}, rejected "
        f"{counts.rejected:,}, duplicate {counts.duplicate:,}; {len(found.sensors)} "
        f"sensor{'' if len(found.sensors) == 1 else 's'}"
    )
    if found.first_s is None or found.last_s is None:
        return f"{text}; times: none"
    return f"{text}; times: {time_text(found.first_s)} to {time_text(found.last_s)}"


def _percent(fraction: float | None) -> str | None:
    return None if fraction is None else f"{fraction:.1%}"


def _kilometres(metres: float | None) -> str | None:
    return None if metres is None else f"{metres / _KILOMETRE_M:.1f}"


def _metres(metres: float | None) -> str | None:
    return None if metres is None else f"{metres:.0f}"


def _time(time_s: float | None) -> str | None:
    if time_s is None or not is_dated(time_s):
        return None if time_s is None else time_text(time_s)
    return f"{day_text(time_s)} {clock_text(time_s)}"


def _sensors(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.sensor_id,
            one.kind,
            f"{one.reports:,}",
            f"{one.duplicates:,}",
            _time(one.first_s),
            _time(one.last_s),
            None if one.mean_per_s is None else f"{one.mean_per_s:.2f}",
            None if one.scan_period_s is None else f"{one.scan_period_s:.3f}",
        )
        for one in found.sensors
    ]
    header = ("sensor", "kind", "reports", "duplicate", "from", "to", "per s", "scan, s")
    return Table("Sensors", header, tuple(rows))


def _identity(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.sensor_id,
            f"{one.aircraft:,}",
            _percent(one.mode_s_fraction),
            _percent(one.mode_3a_fraction),
            _percent(one.located_fraction),
            _percent(one.on_ground_fraction),
            ", ".join(f"{name} {count:,}" for name, count in one.left_out.items()) or None,
        )
        for one in found.sensors
    ]
    header = (
        "sensor", "aircraft", "Mode S", "Mode 3/A", "with position", "on ground", "omitted",
    )  # fmt: skip
    return Table("Measurements", header, tuple(rows))


def _coverage(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.sensor_id,
            _kilometres(one.range_min_m),
            _kilometres(one.range_max_m),
            _sectors(one),
            _percent(one.height_fraction),
            _metres(one.height_min_m),
            _metres(one.height_median_m),
            _metres(one.height_max_m),
        )
        for one in found.sensors
    ]
    header = (
        "sensor", "min. range, km", "max. range, km", "azimuths without plots", "with height",
        "min. height, m", "median, m", "max., m",
    )  # fmt: skip
    return Table("Coverage", header, tuple(rows))


def _sectors(one: InspectedSensor) -> str | None:
    """Return the sectors without plots as intervals."""
    if one.range_max_m is None:
        return None
    intervals: list[list[int]] = []
    for begin in one.empty_sectors_deg:
        if intervals and intervals[-1][1] == begin:
            intervals[-1][1] = begin + _SECTOR_DEG
        else:
            intervals.append([begin, begin + _SECTOR_DEG])
    texts = [f"{begin}–{end}°" for begin, end in intervals[:_INTERVALS_MAX]]
    return ", ".join([*texts, *(["…"] if len(intervals) > _INTERVALS_MAX else [])]) or "none"


def _files(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.file,
            one.form,
            f"{one.bytes:,}",
            f"{one.read:,}",
            f"{one.rejected:,}",
            None if one.quarantined_bytes is None else f"{one.quarantined_bytes:,}",
        )
        for one in found.files
    ]
    header = ("file", "form", "octets", "records", "rejected", "octets quarantined")
    return Table("Files", header, tuple(rows))


def _categories(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (one.category, one.sensor, one.edition or None, f"{one.records:,}")
        for one in found.categories
    ]
    return Table("ASTERIX records", ("category", "sensor", "edition", "records"), tuple(rows))


def _registers(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = []
    for one in found.sensors:
        if not one.registers:
            continue
        others = ", ".join(
            f"{name} {count:,}"
            for name, count in one.registers.items()
            if name not in {*_REGISTERS, "any"}
        )
        counts = (f"{one.registers.get(name, 0):,}" for name in ("any", *_REGISTERS))
        rows.append((one.sensor_id, f"{one.reports:,}", *counts, others or None))
    header = (
        "sensor",
        "reports",
        "with any BDS",
        *(f"BDS {name}" for name in _REGISTERS),
        "others",
    )
    return Table("BDS registers", header, tuple(rows))


def _aircraft_data(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = []
    for one in found.sensors:
        data = one.aircraft_data
        if data is None:
            continue
        rows += [
            (one.sensor_id, name, _percent(value.reports / max(one.measurements, 1)), _noise(value))
            for name, value in data.values.items()
        ]
        dropped = ", ".join(f"{name} {count:,}" for name, count in data.dropped.items())
        rows.append((one.sensor_id, "discarded", None, dropped or "none"))
    header = ("sensor", "aircraft-derived data", "of measurements", "noise, 1 sigma")
    return Table("Aircraft-derived data", header, tuple(rows))


def _noise(value: InspectedQuantity) -> str | None:
    return None if value.sigma is None else f"{value.sigma:.3g}"


def _clocks(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.sensor_id,
            *(
                None if value is None else f"{value:.3f}"
                for value in (
                    one.clock.clock_offset_s,
                    one.clock.latency_min_s,
                    one.clock.latency_median_s,
                    one.clock.latency_p99_s,
                )
            ),
            one.clock.alarm,
        )
        for one in found.sensors
        if one.clock is not None
    ]
    header = ("sensor", "clock offset, s", "latency 1 %, s", "median, s", "99 %, s", "alarm")
    return Table("Reception times", header, tuple(rows))


def _gaps(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (one.sensor_id, time_text(gap.first_s), f"{gap.duration_s:.0f}", f"{one.gaps}")
        for one in found.sensors
        for gap in one.longest_gaps
    ]
    header = ("sensor", "from", "duration, s", "number of gaps")
    return Table("Longest gaps", header, tuple(rows))


def _sites(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.sensor_id,
            None if one.site is None else f"{one.site.latitude_deg:.6f}",
            None if one.site is None else f"{one.site.longitude_deg:.6f}",
            None if one.site is None else f"{one.site.height_m:.0f}",
            None if one.site is None else _metres(one.site.sigma_m),
            "not in the recording; specify it" if one.site is None else one.site.source,
        )
        for one in found.sensors
        if one.kind == "radar" or one.local_fraction
    ]
    header = ("sensor", "latitude, °", "longitude, °", "height, m", "sigma, m", "source")
    return Table("Sites", header, tuple(rows))


def _reported(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (
            one.sensor_id,
            one.parameter,
            f"{one.estimate:+.4g}",
            f"{one.spread:.2g}",
            None if one.prior_sigma is None else f"{one.prior_sigma:.2g}",
            f"{one.reports:,}",
            one.processor_id,
        )
        for one in found.reported_biases
    ]
    header = ("radar", "parameter", "last value", "spread", "prior sigma", "reports", "reported by")
    return Table("Biases reported by another tracker (063)", header, tuple(rows))


def _rejects(found: Inspection) -> Table:
    rows: list[tuple[Value, ...]] = [
        (one.file, one.code, f"{one.count:,}", one.reason or None)
        for one in found.rejects[:_REJECTS_MAX]
    ]
    more = len(found.rejects) - _REJECTS_MAX
    return Table(
        "Rejected",
        ("file", "code", "records", "reason"),
        tuple(rows),
        f"{more} further reasons" if more > 0 else "",
    )


def _notes(found: Inspection) -> list[str]:
    notes = [*found.unknown_editions, *found.moved_files]
    if found.sampled_fraction < 1.0:
        notes.append(
            "Figures for aircraft, coverage and registers are based on "
            f"{found.sampled_fraction:.1%} of the recording; all other figures are based on the "
            "whole recording."
        )
    if found.date is not None:
        notes.append(
            f"According to the recorder's clock, the first day is {found.date}: use --date "
            "when converting."
        )
    if found.categories and not found.sensors:
        notes.append(
            "None of the recorded categories contains measurements: `convert` would produce none."
        )
    if found.system_tracks:
        notes.append(f"{found.system_tracks:,} system track updates from another tracker.")
    notes += [
        f"{one.sensor_id}: {one.clock.reason}"
        for one in found.sensors
        if one.clock is not None and one.clock.reason is not None
    ]
    missing = [one.sensor_id for one in found.sensors if one.kind == "radar" and one.site is None]
    if missing:
        notes.append(f"The site is unknown for {', '.join(missing)}.")
    notes += [
        f"{one.sensor_id}: {one.local_fraction:.0%} of its reports have local coordinates only, "
        "and their reference point is unknown: specify it with --reference."
        for one in found.sensors
        if one.local_fraction and one.kind != "radar" and one.site is None
    ]
    return notes
