"""System tracks (062) of another SDPS, as a reference: `system_tracks.parquet`.

time 070 · track number 040 · position 105 · velocity 185 · Mode 3/A code 060 · address 380/ADR ·
callsign 245, else 380/ID · flight level 136 (measured), else 135 (calculated), unless that is an
altitude with QNH correction · state 080 · ground status 080/SFC, 380/COM, 380/SAB ·
accuracy 500/APC, else 500/APW · aircraft-derived data 380
"""

import numpy as np
import polars as pl

from multiradar_converters.aircraft_data.quantities import QUANTITIES
from multiradar_converters.asterix.decoding.aircraft_items import track_data
from multiradar_converters.asterix.decoding.naming import (
    address_names,
    callsign_names,
    code_names,
    ground_statuses,
    named,
)
from multiradar_converters.asterix.decoding.targets import flight_status
from multiradar_converters.asterix.layout.columns import Columns, Integers, Numbers

#: States of a track, by number.
STATES = ("confirmed", "tentative", "coasting", "ended", "simulated")

SCHEMA = pl.Schema(
    {
        "time_s": pl.Float64(),
        "sensor_id": pl.String(),
        "track_number": pl.Int64(),
        "mode_s_address": pl.String(),
        "mode_3a": pl.String(),
        "callsign": pl.String(),
        "latitude_deg": pl.Float64(),
        "longitude_deg": pl.Float64(),
        "height_m": pl.Float64(),
        "speed_mps": pl.Float64(),
        "heading_deg": pl.Float64(),
        "position_sigma_m": pl.Float64(),
        "state": pl.String(),
        "on_ground": pl.Boolean(),
        **dict.fromkeys(QUANTITIES, pl.Float64()),
    }
)

FLIGHT_LEVEL_M = 30.48
#: Length of a degree of latitude, to 0.6 %.
DEGREE_M = 111_132.0


def read_system_tracks(columns: Columns) -> pl.DataFrame:
    """Read records of category 062.

    Parameters
    ----------
    columns : Columns
        The records.

    Returns
    -------
    DataFrame
        The columns of `SCHEMA` without the sensor; times of day, s. Without implausible
        aircraft-derived data.
    """
    east, north = columns.numbers("185", "VX"), columns.numbers("185", "VY")
    measured, calculated = columns.numbers("136"), columns.numbers("135", "CTB")
    calculated[columns.flags("135", "QNH")] = np.nan
    doubtful = columns.flags("060", "G") | columns.flags("060", "V")
    callsign = columns.integers("245", "CHR")
    values: dict[str, Numbers | Integers] = {
        "time_s": columns.numbers("070"),
        "track_number": columns.integers("040", absent=-1),
        "latitude_deg": columns.numbers("105", "LAT"),
        "longitude_deg": columns.numbers("105", "LON"),
        "height_m": np.where(np.isnan(measured), calculated, measured) * FLIGHT_LEVEL_M,
        "speed_mps": np.hypot(east, north),
        "heading_deg": np.rad2deg(np.arctan2(east, north)) % 360.0,
        "position_sigma_m": _position_sigma(columns),
    }
    texts = {
        "mode_s_address": address_names(columns.integers("380/ADR")),
        "mode_3a": code_names(np.where(doubtful, -1, columns.integers("060", "MODE3A"))),
        "callsign": callsign_names(np.where(callsign < 0, columns.integers("380/ID"), callsign)),
        "state": named(_states(columns), STATES.__getitem__),
        "on_ground": ground_statuses(_ground_status(columns)),
    }
    data, _ = track_data(columns, np.asarray(values["height_m"], np.float64))
    derived = {
        name: data[:, k] if data.shape[1] else np.full(len(columns), np.nan)
        for k, name in enumerate(QUANTITIES)
    }
    made = pl.DataFrame(
        {name: pl.Series(column, nan_to_null=True) for name, column in values.items()}
        | texts
        | {name: pl.Series(column.copy(), nan_to_null=True) for name, column in derived.items()}
    )
    return made.with_columns(pl.col("track_number").replace(-1, None))


def _position_sigma(columns: Columns) -> Numbers:
    """Return the root of the trace of the horizontal covariance, m; NaN without or with zero."""
    planar = np.hypot(columns.numbers("500/APC", "X"), columns.numbers("500/APC", "Y"))
    north_deg, east_deg = columns.numbers("500/APW", "LAT"), columns.numbers("500/APW", "LON")
    shrinking = np.cos(np.deg2rad(columns.numbers("105", "LAT")))
    geographic = np.hypot(north_deg, east_deg * shrinking) * DEGREE_M
    sigma = np.where(planar > 0.0, planar, geographic)
    return np.where(sigma > 0.0, sigma, np.nan)


def _ground_status(columns: Columns) -> Integers:
    """Return 1 on the ground, 0 airborne, -1 unknown.

    A surface track is on the ground. Without the bit, which is also the default, the aircraft
    decides: by its flight status, else by its ground bit where that is set.
    """
    status = flight_status(columns, "380/COM")
    status[(status < 0) & columns.flags("380/SAB", "GBS")] = 1
    status[columns.flags("080+5", "SFC")] = 1
    return status


def _states(columns: Columns) -> Integers:
    state = np.zeros(len(columns), dtype=np.int64)
    # A later state takes precedence.
    for name, flags in (
        ("tentative", columns.flags("080", "CNF")),
        ("coasting", columns.flags("080+3", "CST")),
        ("ended", columns.flags("080+1", "TSE")),
        ("simulated", columns.flags("080+1", "SIM")),
    ):
        state[flags] = STATES.index(name)
    return state
