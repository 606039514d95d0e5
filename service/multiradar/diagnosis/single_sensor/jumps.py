"""Identities whose successive plots are too far apart to be of one aircraft."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.references import candidate_pairs, tracked_paths
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import (
    KEYS,
    Booleans,
    Floats,
    Integers,
    Plots,
    Site,
    positions,
)

#: Successive plots of an identity are those of different aircraft if they are farther apart than an
#: aircraft flies at this speed, m/s, and this distance, m; longest time between them, s, and least
#: number. Fraction of such steps, and of the identities that have some, from which on they are an
#: error: fewer are addresses or numbers that two aircraft share.
STEP_MPS, STEP_M, STEP_MAX_S, STEPS_MIN = 700.0, 5000.0, 30.0, 100
JUMPS_MIN, JUMPING_MIN, JUMPING_PLOTS_MIN = 0.03, 0.5, 10
#: Reflections come from farther away than the aircraft: fraction of single plots off the path that
#: do, and their number, at least. Of plots of other aircraft half do; of 30 % reflections 86 %.
FARTHER_MIN, FARTHER_PLOTS_MIN = 0.75, 20
#: Of the steps that jump, the fraction that still do with the column of the right row.
_SHIFTED_MAX = 0.25
#: Single plots off the path that are compared with the paths of others, and their distance from
#: them, m: that of noise and of turns between two plots.
SINGLE_TESTED_MAX, ON_PATH_M = 300, 1500.0
OTHER_ROWS = "other_rows"


def check_paths(
    comparison: Comparison, names: tuple[str, ...], named: Collection[str]
) -> list[Diagnosis]:
    """Return what `check_jumps` finds of the sensors that no other diagnosis names.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    names : tuple of str
        Identifiers of the sensors.
    named : collection of str
        Sensors with a diagnosis, which may explain it.
    """
    found = []
    for number in comparison.numbers:
        if names[number] not in named:
            site = comparison.site_of_radar(number)
            found.append(check_jumps(names[number], comparison.plots(number), site))
    return [one for one in found if one is not None]


def check_jumps(name: str, plots: Plots, site: Site | None) -> Diagnosis | None:
    """Diagnose identities whose successive plots are too far apart to be of one aircraft.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots.
    site : Site, optional
        Of a radar, rad and m; None for the positions in the columns latitude and longitude.
    """
    # Codes are shared by aircraft.
    for column, key in enumerate(KEYS[:2]):
        rows = np.lexsort((plots.time_s, plots.keys[:, column]))
        own = plots.select(rows[plots.keys[rows, column] >= 0])
        where = positions(own, site)
        known = np.flatnonzero(np.isfinite(where).all(axis=1))
        own, where = own.select(known), where[known]
        names = own.keys[:, column]
        near, apart = _steps(names, own.time_s, where, 1)
        jumps = near & apart
        if np.count_nonzero(near) < STEPS_MIN or jumps.sum() < JUMPS_MIN * near.sum():
            continue
        of_name, counts = np.unique(names, return_counts=True)
        many = of_name[counts >= JUMPING_PLOTS_MIN]
        if np.isin(many, names[:-1][jumps]).sum() < JUMPING_MIN * max(len(many), 1):
            continue
        words = (
            f"{jumps.sum() / near.sum():.0%} of the successive plots with the same {key} are too "
            "far apart to be of one aircraft"
        )
        if site is not None and _are_reflections(names, own, where, jumps):
            return Diagnosis(
                name,
                "reflections",
                f"{name}: its plots probably contain reflections (multipath replies): {words}, "
                "and the isolated plots off the path are at longer range than the aircraft; remove "
                "them, or check the reflector list of the radar",
                "warning",
            )
        share = _share_of_others(names, own, where, jumps)
        if share < JUMPS_MIN:
            continue
        return Diagnosis(
            name,
            OTHER_ROWS,
            f"{name}: {key} probably belongs to other rows: {words}; check how the plots and "
            "their identities were joined",
        )
    return None


# Whether a plot follows one of the same name soon, and whether it is too far away from it; by a
# number of rows.
def _steps(names: Integers, time_s: Floats, where: Floats, rows: int) -> tuple[Booleans, Booleans]:
    apart_s = time_s[rows:] - time_s[:-rows]
    near = (names[rows:] == names[:-rows]) & (apart_s <= STEP_MAX_S)
    apart_m = np.linalg.norm(where[rows:] - where[:-rows], axis=1)
    return near, apart_m > STEP_M + STEP_MPS * apart_s


def check_shifted(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose reported positions with a latitude or longitude of another row.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots, by time.
    """
    names = plots.keys[:, :2].max(axis=1)
    jumps = _share_of_jumps(plots, names)
    if not jumps >= JUMPS_MIN:
        return None
    for column in ("latitude_deg", "longitude_deg"):
        for rows in (1, -1, 2, -2, 3, -3):
            north, east = plots.latitude_deg, plots.longitude_deg
            if column == "latitude_deg":
                north = np.roll(north, -rows)
            else:
                east = np.roll(east, -rows)
            moved = replace(plots, latitude_deg=north, longitude_deg=east)
            if _share_of_jumps(moved, names) < _SHIFTED_MAX * jumps:
                where = "after" if rows > 0 else "before"
                of = f"the row {where}" if abs(rows) == 1 else f"{abs(rows)} rows {where}"
                return Diagnosis(
                    name,
                    OTHER_ROWS,
                    f"{name}: its {column} probably belongs to other rows: with that of {of}, "
                    f"aircraft fly on steadily ({jumps:.0%} of their steps are too long as "
                    "recorded); check how the columns were joined",
                )
    return None


def _share_of_jumps(plots: Plots, names: Integers) -> float:
    rows = np.lexsort((plots.time_s, names))
    rows = rows[names[rows] >= 0]
    own = plots.select(rows)
    near, apart = _steps(names[rows], own.time_s, positions(own, None), 1)
    if np.count_nonzero(near) < STEPS_MIN:
        return 0.0
    return float(np.count_nonzero(near & apart) / np.count_nonzero(near))


# Fraction of the steps that jump to or from the path of another aircraft. A single plot that is on
# no path is a wrong measurement, not one of another row.
def _share_of_others(names: Integers, own: Plots, where: Floats, jumps: Booleans) -> float:
    single = _single(names, own.time_s, where, jumps)
    kept = np.flatnonzero(~single)
    near, apart = _steps(names[kept], own.time_s[kept], where[kept], 1)
    paths = tracked_paths(np.zeros(len(kept), np.int64), names[kept], own.time_s[kept], where[kept])
    tested = np.flatnonzero(single)
    every = -(-len(tested) // SINGLE_TESTED_MAX) if len(tested) else 1
    tested = tested[::every]
    plots = own.select(tested)
    pairs = candidate_pairs(plots, paths, 0.0)
    name_of_path = np.full(int(paths.path.max(initial=-1)) + 1, -1)
    name_of_path[paths.path] = paths.name
    on_path = np.linalg.norm(where[tested][pairs.plot] - pairs.position_m, axis=1) <= ON_PATH_M
    of_other = on_path & (name_of_path[pairs.name] != names[tested][pairs.plot])
    singles = every * len(np.unique(pairs.plot[of_other]))
    return float(((near & apart).sum() + 2 * singles) / max(near.sum() + 2 * singles, 1))


# Plots off the path of their name, before and after which it goes on.
def _single(names: Integers, time_s: Floats, where: Floats, jumps: Booleans) -> Booleans:
    single = np.zeros(len(names), np.bool_)
    for rows in (2, 3):
        if len(names) <= rows:
            break
        near, apart = _steps(names, time_s, where, rows)
        goes_on = np.flatnonzero(near & ~apart & jumps[: len(near)] & jumps[rows - 1 :])
        for between in range(1, rows):
            single[goes_on + between] = True
    return single


# Whether the plots between two others of an aircraft that are near to each other come from farther
# away.
def _are_reflections(names: Integers, own: Plots, where: Floats, jumps: Booleans) -> bool:
    if len(jumps) < 2:
        return False
    near, apart = _steps(names, own.time_s, where, 2)
    off = np.flatnonzero(jumps[:-1] & jumps[1:] & near & ~apart) + 1
    farther = own.range_m[off] > np.maximum(own.range_m[off - 1], own.range_m[off + 1])
    return len(off) >= FARTHER_PLOTS_MIN and float(np.mean(farther)) >= FARTHER_MIN
