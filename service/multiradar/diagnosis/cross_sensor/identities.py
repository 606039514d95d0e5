"""Identities that are the same for all aircraft of a sensor."""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import KEYS, Floats, Plots, Site, located, reported

#: Minimum fraction of plots with one value.
SAME_MIN = 0.95
#: Time window, s, the scan of a long-range radar; cell size, m; minimum median number of cells
#: occupied in a window. One aircraft flies 4 km in it and occupies at most two cells except at a
#: corner; two aircraft with the same address occupy up to four.
WINDOW_S, CELL_M, CELLS_MIN = 12.0, 20_000.0, 6
_TEXTS = {"track_number": "d", "mode_s_address": "06X", "mode_3a": "04o"}


def check_identities(name: str, plots: Plots, site: Site | None) -> Diagnosis | None:
    """Diagnose one track number, address or code shared by many aircraft.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots.
    site : Site, optional
        Of a radar, rad and m; None for a sensor that reports positions.
    """
    for column, key in enumerate(KEYS):
        known = np.flatnonzero(plots.keys[:, column] >= 0)
        if len(known) < TESTED_MIN:
            continue
        values, counts = np.unique(plots.keys[known, column], return_counts=True)
        value = int(values[counts.argmax()])
        if counts.max() < SAME_MIN * len(known):
            continue
        cells = _cells(plots.select(known), site)
        if cells >= CELLS_MIN:
            return Diagnosis(
                name,
                "identity",
                f"{name}: {key} is probably the same for all its aircraft: the value is "
                f"{value:{_TEXTS[key]}} in {counts.max() / len(known):.0%} of the plots that have "
                f"one, and plots within {WINDOW_S:.0f} s of each other are spread over "
                f"{cells:.0f} cells of {CELL_M / 1e3:.0f} km; leave {key} empty where the "
                "aircraft is not identified",
            )
    return None


# Median number of cells occupied by the plots of a window.
def _cells(plots: Plots, site: Site | None) -> float:
    position = (
        reported(plots)
        if site is None
        else located(site, plots.range_m, np.radians(plots.azimuth_deg), plots.heights())
    )
    good = np.isfinite(position).all(axis=1)
    window = _numbers(plots.time_s[good, None], WINDOW_S)
    cell = _numbers(position[good], CELL_M)
    cells = np.unique(np.column_stack([window, cell]), axis=0)
    _, counts = np.unique(cells[:, 0], return_counts=True)
    return float(np.median(counts)) if len(counts) else 0.0


def _numbers(values: Floats, width: float) -> Floats:
    found: Floats = np.floor((values - values.min(axis=0, initial=np.inf)) / width)
    return found
