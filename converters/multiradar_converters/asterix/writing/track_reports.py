"""System tracks as records of category 062, edition 1.21 (compatible with 1.12 and later).

======================  =====================================================================
070 105 040 015 010     always
100 500/APC 500/COV     with a Cartesian plane
185                     velocity at the aircraft: x east, y true north
060 380/ADR 380/ID      code, address and callsign received
080                     MON MRH SRC CNF, TSE TSB AFF, CST PSR SSR MDS ADS, SFC MLAT
136                     flight level as last measured
130 or 135              height of the track: geometric, or barometric without QNH
220 200                 rate of climb; modes of movement, where one of them is known
290                     TRK, and PSR SSR MDS ES MLT of the updating sources
295                     MFL and MDA: ages of flight level and code
340                     last plot of a radar, corrected for biases
500/APW ATV AGA ABA     one standard deviation
======================  =====================================================================

Numbers are in SI units and degrees; NaN and -1 mean absent. An item is omitted if its number is out
of range; ages and accuracies are clamped, which the standard calls "maximum value or above".
"""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from multiradar_converters.asterix.decoding.system_tracks import DEGREE_M, FLIGHT_LEVEL_M
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.writing.encoding import Records
from multiradar_converters.asterix.writing.senders import Sender, ticks_of_day
from multiradar_schemas.measurements.units import FOOT_M, NAUTICAL_MILE_M

CATEGORY, EDITION = 62, "1.21"

#: Sources of track updates, in the order of the columns of ages; ADS-B counts as 1090 MHz extended
#: squitter.
SOURCES = ("PSR", "SSR", "MDS", "ES", "MLT")
#: Part and bit of item 080 for a source older than the threshold.
_OLD = (("080+3", "PSR"), ("080+3", "SSR"), ("080+3", "MDS"), ("080+3", "ADS"), ("080+5", "MLAT"))

#: Values of item 080/SRC and of 340/TYP.
NO_SOURCE, TRIANGULATION = 0, 3
#: Value of unknown parts of item 200.
UNDETERMINED = 3

FOOT_PER_MINUTE_MPS = FOOT_M / 60.0
_LONGITUDE_STEPS = 1 << 26
_AZIMUTH_STEPS = 1 << 16


@dataclass(frozen=True)
class TrackReports:
    """Tracks at one time, a row per track.

    Attributes
    ----------
    time_s : float
        The time, s; the time of day is its remainder by days.
    number : int64[n]
        Track number, 0 to 65535.
    latitude_deg, longitude_deg : float64[n]
        WGS 84 position at that time.
    x_m, y_m : float64[n]
        The same in the Cartesian plane; NaN without one.
    velocity_east_mps, velocity_north_mps : float64[n]
        Velocity at the aircraft.
    mode_3a, mode_s_address, callsign : int64[n]
        -1 for none; the callsign as eight six-bit characters.
    code_changed : bool[n]
        Whether the code differs from the last report.
    measured_height_m : float64[n]
        Pressure altitude last measured.
    barometric_m, geometric_m : float64[n]
        Height of the track, barometric or above the ellipsoid; at most one of them.
    climb_mps : float64[n]
        Rate of climb.
    turning, speeding, climbing : int64[n]
        Parts TRANS, LONG and VERT of item 200; 3 for unknown.
    monosensor, tentative, first, last, implausible, coasting, on_ground : bool[n]
        Bits MON, CNF, TSB, TSE, AFF, CST and SFC of item 080.
    track_age_s : float64[n]
        Time since initiation.
    age_s : float64[n, 5]
        Time since the last update by each of `SOURCES`; NaN for never.
    height_age_s, code_age_s : float64[n]
        Time since the last height, and code; NaN for never.
    old_s : float
        Threshold of item 080 for the age of sources.
    sensor : int64[n]
        256 × SAC + SIC of the radar of the last plot; -1 if it is not from a radar, or without
        SAC and SIC.
    range_m, azimuth_deg : float64[n]
        That plot, corrected for biases.
    plot_height_m : float64[n]
        Its Mode C.
    plot_mode_3a, plot_type : int64[n]
        Its code, -1 for none, and its type as in item 340/TYP.
    variance_east_m2, variance_north_m2, covariance_m2 : float64[n]
        Covariance of the position, on true axes at the aircraft.
    variance_x_m2, variance_y_m2, covariance_xy_m2 : float64[n]
        The same on the axes of the Cartesian plane; NaN without one.
    velocity_sigma_mps, height_sigma_m : float64[n]
        Standard deviations; that of the velocity per axis.
    """

    time_s: float
    number: Integers
    latitude_deg: Numbers
    longitude_deg: Numbers
    x_m: Numbers
    y_m: Numbers
    velocity_east_mps: Numbers
    velocity_north_mps: Numbers
    mode_3a: Integers
    mode_s_address: Integers
    callsign: Integers
    code_changed: Flags
    measured_height_m: Numbers
    barometric_m: Numbers
    geometric_m: Numbers
    climb_mps: Numbers
    turning: Integers
    speeding: Integers
    climbing: Integers
    monosensor: Flags
    tentative: Flags
    first: Flags
    last: Flags
    implausible: Flags
    coasting: Flags
    on_ground: Flags
    track_age_s: Numbers
    age_s: Numbers
    height_age_s: Numbers
    code_age_s: Numbers
    old_s: float
    sensor: Integers
    range_m: Numbers
    azimuth_deg: Numbers
    plot_height_m: Numbers
    plot_mode_3a: Integers
    plot_type: Integers
    variance_east_m2: Numbers
    variance_north_m2: Numbers
    covariance_m2: Numbers
    variance_x_m2: Numbers
    variance_y_m2: Numbers
    covariance_xy_m2: Numbers
    velocity_sigma_mps: Numbers
    height_sigma_m: Numbers

    def __len__(self) -> int:
        return len(self.number)

    def select(self, rows: Integers | Flags) -> Self:
        """Return selected rows."""
        columns: dict[str, Any] = {one.name: getattr(self, one.name) for one in fields(self)}
        chosen: dict[str, Any] = {
            name: value[rows] if isinstance(value, np.ndarray) else value
            for name, value in columns.items()
        }
        return type(self)(**chosen)


def track_records(reports: TrackReports, sender: Sender) -> Records:
    """Return system tracks as records.

    Returns
    -------
    Records
        Of category 062, one per track, in order.
    """
    records = Records(layout_of(CATEGORY, EDITION), len(reports))
    sender.sign(records)
    records.put("070", ticks_of_day(reports.time_s))
    records.put("040", reports.number)
    _write_position(records, reports)
    _write_identity(records, reports)
    _write_status(records, reports)
    _write_ages(records, reports)
    _write_height(records, reports)
    _write_movement(records, reports)
    _write_plot(records, reports)
    _write_accuracy(records, reports)
    return records


def _write_position(records: Records, reports: TrackReports) -> None:
    latitude = np.rint(reports.latitude_deg * (_LONGITUDE_STEPS / 360.0))
    # +180 degrees is written as -180 degrees.
    half = _LONGITUDE_STEPS // 2
    longitude = np.rint(reports.longitude_deg * (_LONGITUDE_STEPS / 360.0)) + half
    records.put("105", {"LAT": latitude, "LON": np.mod(longitude, _LONGITUDE_STEPS) - half})
    records.measure("100", {"X": reports.x_m, "Y": reports.y_m})
    records.measure("185", {"VX": reports.velocity_east_mps, "VY": reports.velocity_north_mps})


def _write_identity(records: Records, reports: TrackReports) -> None:
    code = {"CH": reports.code_changed, "MODE3A": reports.mode_3a}
    records.put("060", code, reports.mode_3a >= 0)
    records.put("380/ADR", reports.mode_s_address, reports.mode_s_address >= 0)
    # Not in item 245: the standard forbids it where 380/ID can be used.
    records.put("380/ID", reports.callsign, reports.callsign >= 0)


def _write_status(records: Records, reports: TrackReports) -> None:
    geometric = ~np.isnan(reports.geometric_m)
    records.put(
        "080",
        {
            "MON": reports.monosensor,
            "MRH": geometric,
            "SRC": np.where(geometric, TRIANGULATION, NO_SOURCE),
            "CNF": reports.tentative,
        },
    )
    second = {"TSE": reports.last, "TSB": reports.first, "AFF": reports.implausible}
    records.put("080+1", second)
    # Written so that a source without any update counts as old.
    old = {name: ~(reports.age_s[:, k] <= reports.old_s) for k, (_, name) in enumerate(_OLD)}
    fourth = {name: old[name] for part, name in _OLD if part == "080+3"}
    records.put("080+3", {"CST": reports.coasting, **fourth})
    records.put("080+4", {"SDS": _seen_by(old)})
    records.put("080+5", {"SFC": reports.on_ground, "MLAT": old["MLAT"]})


def _seen_by(old: dict[str, Flags]) -> Integers:
    # Item 080/SDS: primary radars and others, others only, primary only, none.
    primary = ~old["PSR"]
    others = ~(old["SSR"] & old["MDS"] & old["ADS"] & old["MLAT"])
    return np.select([primary & others, others, primary], [0, 1, 2], 3)


def _write_ages(records: Records, reports: TrackReports) -> None:
    records.measure("290/TRK", reports.track_age_s, clamped=True)
    for k, name in enumerate(SOURCES):
        records.measure(f"290/{name}", reports.age_s[:, k], clamped=True)
    records.measure("295/MFL", reports.height_age_s, clamped=True)
    records.measure("295/MDA", reports.code_age_s, clamped=True)


def _write_height(records: Records, reports: TrackReports) -> None:
    records.measure("136", reports.measured_height_m / FLIGHT_LEVEL_M)
    records.measure("130", reports.geometric_m / FOOT_M)
    records.measure("135", {"CTB": reports.barometric_m / FLIGHT_LEVEL_M})
    records.measure("220", reports.climb_mps / FOOT_PER_MINUTE_MPS)


def _write_movement(records: Records, reports: TrackReports) -> None:
    parts = {"TRANS": reports.turning, "LONG": reports.speeding, "VERT": reports.climbing}
    known = np.any([part != UNDETERMINED for part in parts.values()], axis=0)
    records.put("200", parts, known)


def _write_plot(records: Records, reports: TrackReports) -> None:
    known = (reports.sensor >= 0) & ~np.isnan(reports.range_m)
    records.put("340/SID", {"SAC": reports.sensor >> 8, "SIC": reports.sensor & 255}, known)
    steps = np.rint(np.nan_to_num(reports.azimuth_deg) * (_AZIMUTH_STEPS / 360.0))
    distance = reports.range_m / NAUTICAL_MILE_M
    # A fixed item has both numbers, and 360 degrees is not an azimuth.
    azimuth = np.mod(steps, _AZIMUTH_STEPS) * (360.0 / _AZIMUTH_STEPS)
    records.measure("340/POS", {"RHO": distance, "THETA": azimuth}, known)
    level = reports.plot_height_m / FLIGHT_LEVEL_M
    records.measure("340/MDC", {"LMC": level}, known)
    records.put("340/MDA", {"MODE3A": reports.plot_mode_3a}, known & (reports.plot_mode_3a >= 0))
    records.put("340/TYP", {"TYP": reports.plot_type}, known)


def _write_accuracy(records: Records, reports: TrackReports) -> None:
    def both(node: str, names: tuple[str, str], first: Numbers, second: Numbers) -> None:
        records.measure(node, dict(zip(names, (first, second), strict=True)), clamped=True)

    sigma_x, sigma_y = np.sqrt(reports.variance_x_m2), np.sqrt(reports.variance_y_m2)
    both("500/APC", ("X", "Y"), sigma_x, sigma_y)
    covariance = reports.covariance_xy_m2
    root = np.sign(covariance) * np.sqrt(np.abs(covariance))
    records.measure("500/COV", root, clamped=True)
    north_deg = np.sqrt(reports.variance_north_m2) / DEGREE_M
    # At a pole the longitude is undefined: the maximum value.
    shrinking = np.maximum(np.cos(np.radians(reports.latitude_deg)), 1e-9)
    east_deg = np.sqrt(reports.variance_east_m2) / (DEGREE_M * shrinking)
    both("500/APW", ("LAT", "LON"), north_deg, east_deg)
    geometric = ~np.isnan(reports.geometric_m)
    height = reports.height_sigma_m
    records.measure("500/AGA", height / FOOT_M, geometric, clamped=True)
    barometric = ~np.isnan(reports.barometric_m)
    records.measure("500/ABA", height / FLIGHT_LEVEL_M, barometric, clamped=True)
    both("500/ATV", ("X", "Y"), reports.velocity_sigma_mps, reports.velocity_sigma_mps)
