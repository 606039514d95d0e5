"""`sensors.toml`: sources of the positions, and a reference position for tracking."""

import numpy as np

from multiradar_converters.adsb.table import Written
from multiradar_converters.sensors_template import (
    MIDDLE_OF_REPORTS,
    FoundSensor,
    sensors_text,
)


def sensors_toml(written: Written) -> str:
    """Write `sensors.toml`.

    Parameters
    ----------
    written : Written
        Figures of the table.

    Returns
    -------
    str
        TOML that can be loaded without changes.
    """
    found = []
    for kind, count in written.kinds.items():
        if not count:
            continue
        x, y, z = written.middle[kind].tolist()
        latitude = float(np.degrees(np.arctan2(z, np.hypot(x, y))))
        longitude = float(np.degrees(np.arctan2(y, x)))
        reports = f"{count} report{'' if count == 1 else 's'}"
        site = (latitude, longitude, 0.0)
        found.append(FoundSensor(kind, kind, reports, site=site, site_source=MIDDLE_OF_REPORTS))
    return sensors_text(found)
