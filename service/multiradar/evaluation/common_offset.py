"""An offset that all tracks have in common from the reference: a displaced reference."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.measures.update_errors import UpdateErrors

#: Aircraft with so many updates count; fewer of them show no common offset.
UPDATES_MIN, AIRCRAFT_MIN = 20, 4
#: Smaller offsets are those of registration, m.
OFFSET_MIN_M = 50.0
#: Half of the aircraft are within this fraction of the offset from it, and the errors without the
#: offset are smaller by this factor: then it is most of the error.
SCATTER_MAX, REMAINING_MAX = 0.5, 0.5
#: From this offset on, m, it is an error: the distance of two datums or antennas is smaller.
ERROR_MIN_M = 250.0
_POINTS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


@dataclass(frozen=True, slots=True)
class CommonOffset:
    """What all tracks are displaced by.

    Attributes
    ----------
    sentence : str
        Its size and direction, and what to check.
    dominates : bool
        Whether it is so large that the other figures say little.
    """

    sentence: str
    dominates: bool


def common_offset(errors: UpdateErrors) -> CommonOffset | None:
    """Return the offset that all tracks have in common from the reference, if it is most of it.

    Parameters
    ----------
    errors : UpdateErrors
        Errors of updates.

    Returns
    -------
    CommonOffset or None
        None where it is small, differs between aircraft, or few aircraft were compared.
    """
    aircraft, counts = np.unique(errors.aircraft, return_counts=True)
    medians_m = np.array(
        [
            np.median(errors.offset_m[errors.aircraft == one], axis=0)
            for one in aircraft[counts >= UPDATES_MIN]
        ]
    ).reshape(-1, 2)
    if len(medians_m) < AIRCRAFT_MIN:
        return None
    east_m, north_m = np.median(medians_m, axis=0).tolist()
    size_m = float(np.hypot(east_m, north_m))
    scatter_m = float(np.median(np.hypot(*(medians_m - [east_m, north_m]).T)))
    before_m = float(np.median(errors.position_m))
    after_m = float(np.median(np.hypot(*(errors.offset_m - [east_m, north_m]).T)))
    if size_m < OFFSET_MIN_M or scatter_m > SCATTER_MAX * size_m:
        return None
    if after_m > REMAINING_MAX * before_m:
        return None
    point = _POINTS[round(np.degrees(np.arctan2(east_m, north_m)) / 45.0) % 8]
    return CommonOffset(
        f"all tracks are displaced by about {size_m:.0f} m to the {point} of the reference "
        f"({east_m:+.0f} m east, {north_m:+.0f} m north; median error {before_m:.0f} m, with this "
        f"offset removed {after_m:.0f} m): check the positions of the reference (another datum or "
        "origin?) and the sensor sites",
        size_m >= ERROR_MIN_M,
    )
