"""Displacements and positions in the words of a diagnosis."""

import math

_COMPASS = (
    "north",
    "north-east",
    "east",
    "south-east",
    "south",
    "south-west",
    "west",
    "north-west",
)
#: Shorter displacements have a digit more, km.
_NEAR_KM = 10.0

#: How the sites of all radars may be displaced instead of the positions of one sensor.
OPPOSITE = "the same distance in the opposite direction"


def displacement(distance_m: float, azimuth_rad: float) -> str:
    """Return a distance with the nearest of eight directions, such as `1.99 km south`.

    Parameters
    ----------
    distance_m, azimuth_rad : float
        Polar coordinates; azimuth clockwise from north.
    """
    course = _COMPASS[round(azimuth_rad / (math.pi / 4.0)) % len(_COMPASS)]
    distance_km = distance_m / 1e3
    return f"{distance_km:.{2 if distance_km < _NEAR_KM else 1}f} km {course}"


def place(latitude_rad: float, longitude_rad: float) -> str:
    """Return a position as in the sensors file, degrees."""
    return f"{math.degrees(latitude_rad):.4f}, {math.degrees(longitude_rad):.4f}"
