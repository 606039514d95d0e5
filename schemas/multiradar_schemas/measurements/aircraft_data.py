"""Aircraft-derived data of measurements: what the aircraft reports about its flight.

Sources: Mode S registers 4,0, 5,0 and 6,0 (I048/250), ADS-B, categories 021 and 062, readsb.
"""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described

TURN_DEG = 360.0
ROLL_MAX_DEG = 90.0
TRACK_ANGLE_RATE_MAX_DEG_PER_S = 45.0
SPEED_MAX_M_S = 1500.0
MACH_MAX = 5.0
VERTICAL_RATE_MAX_M_S = 200.0
SELECTED_MIN_M = -1000.0
SELECTED_MAX_M = 40_000.0

_ABSENT = "not received, or implausible"


def _angle(meaning: str) -> object:
    return described(meaning, unit="degree", source="aircraft", absent=_ABSENT)


def _speed(meaning: str) -> object:
    return described(meaning, unit="m/s", source="aircraft", absent=_ABSENT)


_Direction = Annotated[float, Field(ge=0.0, lt=TURN_DEG)]
_Speed = Annotated[float, Field(ge=0.0, le=SPEED_MAX_M_S)]


class AircraftData(Record):
    """Fields of aircraft-derived data, all optional."""

    magnetic_heading_deg: (
        Annotated[_Direction, _angle("Magnetic heading, clockwise from magnetic north")] | None
    ) = None
    roll_deg: (
        Annotated[
            float,
            Field(ge=-ROLL_MAX_DEG, le=ROLL_MAX_DEG),
            _angle("Roll angle, positive with the right wing down"),
        ]
        | None
    ) = None
    track_angle_deg: (
        Annotated[
            _Direction, _angle("Direction of motion over the ground, clockwise from true north")
        ]
        | None
    ) = None
    track_angle_rate_deg_s: (
        Annotated[
            float,
            Field(ge=-TRACK_ANGLE_RATE_MAX_DEG_PER_S, le=TRACK_ANGLE_RATE_MAX_DEG_PER_S),
            described(
                "Track angle rate, positive in right turns",
                unit="degree/s",
                source="aircraft",
                absent=_ABSENT,
            ),
        ]
        | None
    ) = None
    ground_speed_m_s: Annotated[_Speed, _speed("Ground speed")] | None = None
    true_airspeed_m_s: Annotated[_Speed, _speed("True airspeed")] | None = None
    indicated_airspeed_m_s: Annotated[_Speed, _speed("Indicated airspeed")] | None = None
    mach: (
        Annotated[
            float,
            Field(ge=0.0, le=MACH_MAX),
            described("Mach number", unit="1", source="aircraft", absent=_ABSENT),
        ]
        | None
    ) = None
    vertical_rate_m_s: (
        Annotated[
            float,
            Field(ge=-VERTICAL_RATE_MAX_M_S, le=VERTICAL_RATE_MAX_M_S),
            _speed(
                "Vertical rate, positive in a climb; inertial if reported, otherwise barometric"
            ),
        ]
        | None
    ) = None
    selected_altitude_m: (
        Annotated[
            float,
            Field(ge=SELECTED_MIN_M, le=SELECTED_MAX_M),
            described(
                "Altitude selected on the mode control panel or in the flight management system: "
                "pressure altitude, as reported",
                unit="m",
                source="aircraft",
                absent=_ABSENT,
            ),
        ]
        | None
    ) = None
