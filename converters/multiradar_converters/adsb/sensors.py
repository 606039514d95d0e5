"""The skeleton of `sensors.toml`: who sent the positions, and a place to track at."""

import numpy as np

from multiradar_converters.adsb.table import Written


def sensors_toml(written: Written) -> str:
    """Write the skeleton.

    Parameters
    ----------
    written : Written
        What the table holds.

    Returns
    -------
    str
        TOML that can be loaded as it is.
    """
    parts = [
        "# Sensors found in the trajectories. Radars that saw the same aircraft may be added.\n"
    ]
    for kind, count in written.kinds.items():
        if not count:
            continue
        x, y, z = written.middle[kind].tolist()
        latitude = float(np.degrees(np.arctan2(z, np.hypot(x, y))))
        longitude = float(np.degrees(np.arctan2(y, x)))
        parts.append(
            f'\n[[sensor]]\nid = "{kind}"\nkind = "{kind}"\n'
            f"# {count} report{'' if count == 1 else 's'}\n"
            "# the middle of its reports, for a plane to track in\n"
            f"latitude_deg = {latitude:.2f}\n"
            f"longitude_deg = {longitude:.2f}\n"
            "height_m = 0.0\n"
        )
    return "".join(parts)
