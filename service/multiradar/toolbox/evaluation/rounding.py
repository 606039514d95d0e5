"""Whether the positions of a reference were rounded."""

import numpy as np

from multiradar.diagnosis.plots import KEYS, Plots
from multiradar.diagnosis.single_sensor.steps import POSITION_SIGMA_M, check_rounded
from multiradar.evaluation.trajectories import Reference

#: Decimals of degrees, a tenth of a millimetre.
_DECIMALS = 9
#: More rows are thinned.
_ROWS_MAX = 100_000


def rounded_positions(reference: Reference) -> list[str]:
    """Return a warning where the rounding of the positions adds an error that counts.

    Parameters
    ----------
    reference : Reference
        The reference.
    """
    latitude_rad, longitude_rad = reference.plane.to_geodetic(*reference.position_m.T)
    degrees = np.degrees(np.stack([latitude_rad, longitude_rad]))
    # Equal positions differ by the rounding of the plane.
    latitude_deg, longitude_deg = np.round(degrees, _DECIMALS).astype(np.float64)
    unknown = np.full(len(reference.time_s), np.nan)
    keys = np.full((len(unknown), len(KEYS)), -1, np.int64)
    keys[:, 0] = reference.aircraft
    rows = Plots(
        time_s=reference.time_s,
        range_m=unknown,
        azimuth_deg=unknown,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_m=reference.height_m,
        keys=keys,
    )
    found = check_rounded(
        "the reference",
        rows.thinned(_ROWS_MAX),
        {"latitude_deg": POSITION_SIGMA_M},
        configured=False,
    )
    return [] if found is None else [found.sentence]
