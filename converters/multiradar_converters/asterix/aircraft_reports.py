"""Aircraft-derived data of a recording: checks over all reports of a sensor, and figures."""

from typing import NamedTuple

import numpy as np

from multiradar_converters.aircraft_data.checking import reason_bits
from multiradar_converters.aircraft_data.figures import DataFigures
from multiradar_converters.aircraft_data.plausibility import drop, findings
from multiradar_converters.aircraft_data.sequences import (
    Reports,
    plane_positions,
    sequence_findings,
)
from multiradar_converters.aircraft_data.variation import magnetic_variation
from multiradar_converters.asterix.layout.columns import Integers, Numbers


class Screened(NamedTuple):
    """Values that passed all checks, and the figures of their sensors, by number."""

    values: Numbers
    documents: dict[int, dict[str, object]]


def screened(
    values: Numbers,
    dropped: Integers,
    sensor: Integers,
    address: Integers,
    kept: dict[str, Numbers],
) -> Screened:
    """Check the data of all reports, sensor by sensor.

    Parameters
    ----------
    values : float64[n, 10] or float64[n, 0]
        Values that passed the checks of single reports.
    dropped : int64[n]
        Reasons for which others were dropped, bits.
    sensor, address : int64[n]
        Number of the sensor, and Mode S address; -1 for none.
    kept : dict of float64[n]
        Times, positions and heights, by column.

    Returns
    -------
    Screened
        Sensors without data have no figures.
    """
    if not values.shape[1]:
        return Screened(values, {})
    values = values.copy()
    documents: dict[int, dict[str, object]] = {}
    for number in np.unique(sensor).tolist():
        own = np.flatnonzero(sensor == number)
        columns = {name: column[own] for name, column in kept.items()}
        document, values[own] = _of_sensor(values[own], dropped[own], address[own], columns)
        if document:
            documents[number] = document
    return Screened(values, documents)


def _of_sensor(
    values: Numbers, dropped: Integers, address: Integers, columns: dict[str, Numbers]
) -> tuple[dict[str, object], Numbers]:
    height_m, time_s = columns["height_m"], columns["time_s"]
    variation = magnetic_variation(values, height_m)
    found = [] if variation is None else findings(values, height_m, variation)
    values = drop(values, found)
    range_m = columns["range_m"]
    east, north = plane_positions(range_m, columns["azimuth_deg"], height_m)
    aircraft = np.where(address > 0, address, -1)
    position = columns["latitude_deg"], columns["longitude_deg"]
    reports = Reports(aircraft, time_s, east, north, range_m, *position)
    over_time = sequence_findings(values, reports)
    values = drop(values, over_time)
    figures = DataFigures()
    bits = dropped | reason_bits([*found, *over_time], len(values))
    figures.add(values, bits, aircraft, time_s, height_m)
    return figures.document(), values
