"""Sensors by ASTERIX source: SAC, SIC and kind of measurement."""

import re
from dataclasses import replace

import numpy as np

from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint
from multiradar_converters.asterix.live.reception import LiveOptions

# `SAC-SIC`, and the kind for a second kind of measurement of one source.
_NAME = re.compile(r"(\d{1,3})-(\d{1,3})(?:-(mlat|adsb))?")
_KINDS = {KIND_RADAR: ("radar",), KIND_POSITION: ("mlat", "adsb")}


def names_by_source(table: SensorTable) -> dict[tuple[int, str], str]:
    """Return identifiers of sensors by source (256 × SAC + SIC) and kind.

    Parameters
    ----------
    table : SensorTable
        The sensors; ids and aliases of the form `SAC-SIC` count.
    """
    names: dict[tuple[int, str], str] = {}
    rows = [*enumerate(table.ids), *((row, name) for name, row in table.aliases)]
    # A name with a kind takes precedence.
    for row, name in sorted(rows, key=lambda one: one[1].count("-")):
        match = _NAME.fullmatch(name)
        if match is None or max(int(match[1]), int(match[2])) > 255:
            continue
        source = int(match[1]) << 8 | int(match[2])
        for kind in _KINDS.get(int(table.kinds[row]), ()):
            if match[3] in (None, kind):
                names[source, kind] = table.ids[row]
    return names


def of_sensors(table: SensorTable, options: LiveOptions) -> LiveOptions:
    """Return options with the names, scan periods and reference points of sensors."""
    return replace(
        options,
        names=names_by_source(table),
        scan_periods=scan_periods_by_source(table),
        references=references_by_source(table),
    )


def references_by_source(table: SensorTable) -> dict[int, ReferencePoint]:
    """Return the configured sites of multilateration systems, by source: their reference points."""
    rows = {name: row for row, name in enumerate(table.ids)}
    found = {}
    for (source, kind), name in names_by_source(table).items():
        row = rows[name]
        latitude, longitude = table.latitude_rad[row], table.longitude_rad[row]
        if kind == "mlat" and not table.self_reported[row] and not np.isnan(latitude + longitude):
            found[source] = ReferencePoint(
                float(np.degrees(latitude)), float(np.degrees(longitude))
            )
    return found


def scan_periods_by_source(table: SensorTable) -> dict[int, float]:
    """Return the configured scan periods, s, by source."""
    periods = dict(zip(table.ids, table.rotation_period_s.tolist(), strict=True))
    return {
        source: periods[name]
        for (source, _kind), name in names_by_source(table).items()
        if not np.isnan(periods[name])
    }
