"""Identities that are the same for all aircraft of a sensor, or not those of its aircraft."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.agreement import polar_agreement, seen_from
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.hypotheses import as_given
from multiradar.diagnosis.cross_sensor.references import (
    Pairs,
    are_named,
    common_key,
)
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import (
    KEYS,
    Floats,
    Plots,
    Site,
    located,
    plots_of,
    reported,
)

#: Minimum fraction of plots with one value.
SAME_MIN = 0.95
#: Time window, s, the scan of a long-range radar; cell size, m; minimum median number of cells
#: occupied in a window. One aircraft flies 4 km in it and occupies at most two cells except at a
#: corner; two aircraft with the same address occupy up to four.
WINDOW_S, CELL_M, CELLS_MIN = 12.0, 20_000.0, 6
#: Plots of one radar under two identifiers: its revolution, by the configured scan periods; plots
#: of the smaller part; distance of their sites, m; of the plots of aircraft that both detect within
#: so many revolutions, at most this fraction is in the same one.
SPLIT_PERIOD, SPLIT_PART_MIN, SPLIT_APART_M = 0.01, 0.2, 200.0
SPLIT_SCANS, SPLIT_SAME_MAX = 3.0, 0.02
#: A column of another row explains at least so much more; a smaller agreement is reported without a
#: cause.
SHIFTED_MORE_MIN, UNEXPLAINED_MAX = 0.3, 0.1
_IDENTITIES = "identities"
_COLUMNS = {
    "range_m": "its ranges (range_m)",
    "azimuth_deg": "its azimuths (azimuth_deg)",
    _IDENTITIES: "the identities of its aircraft (track_number, mode_s_address, mode_3a)",
}
#: Codes that no radar measures of all aircraft (2000: without an assigned code, which only traffic
#: from oceanic airspace has), and those of VFR flights, which are lower than this, m (FL195).
_UNASSIGNED, _VFR = ("0000", "2000"), ("1200", "1400", "7000", "7001", "7010")
_VFR_MAX_M = 5943.6
#: Place of mode_s_address in `KEYS`, and aircraft that contradict two sensors.
_ADDRESS_KEY, _CONTRADICTED_MIN = KEYS.index("mode_s_address"), 3
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


def check_one_code(name: str, frame: pl.DataFrame, site: Site | None) -> Diagnosis | None:
    """Diagnose one code of conspicuity (of `CONSPICUITY`) in the plots of all aircraft.

    A warning where addresses identify the aircraft. 1000 may be the code of all aircraft with
    Mode S, and codes of flights under visual flight rules may be those of all low traffic.

    Parameters
    ----------
    name : str
        The sensor.
    frame : DataFrame
        Its plots, of `Source.plots`.
    site : Site, optional
        Of a radar, rad and m; None for a sensor that reports positions.
    """
    coded = frame.drop_nulls("mode_3a")
    if len(coded) < TESTED_MIN:
        return None
    code, count = coded["mode_3a"].value_counts(sort=True).row(0)
    if count < SAME_MIN * len(coded) or code not in (*_UNASSIGNED, *_VFR):
        return None
    plots = plots_of(coded)
    cells = _cells(plots, site)
    heights = plots.height_m[np.isfinite(plots.height_m)]
    low = bool(len(heights)) and float(np.median(heights)) <= _VFR_MAX_M
    if cells < CELLS_MIN or (code in _VFR and low):
        return None
    why = ", most of them above FL195" if code in _VFR and len(heights) else ""
    addressed = coded["mode_s_address"].count() > 0.5 * len(coded)
    return Diagnosis(
        name,
        "identity",
        f"{name}: mode_3a is probably a placeholder: the value is {code} in "
        f"{count / len(coded):.0%} of the plots that have one, although aircraft are in "
        f"{cells:.0f} cells of {CELL_M / 1e3:.0f} km at a time{why}; fill it with the measured "
        "codes, or leave it empty",
        "warning" if addressed or not (len(heights) or code in _UNASSIGNED) else "error",
    )


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


def check_split_radars(comparison: Comparison, names: tuple[str, ...]) -> list[Diagnosis]:
    """Diagnose two radars at one site that never detect an aircraft in the same revolution.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    names : tuple of str
        Identifiers of the sensors.

    Returns
    -------
    list of Diagnosis
        For the later one of each pair.
    """
    radars = [one for one in comparison.numbers if comparison.is_radar(one)]
    return [
        Diagnosis(
            names[later],
            "sensor_split",
            f"{names[later]} and {names[first]} are at the same site and never detect an aircraft "
            "in the same revolution: probably the plots of one radar under two identifiers, so "
            "that each misses the plots of the other; give them one identifier",
            "warning",
        )
        for first, later in combinations(radars, 2)
        if comparison.apart_m(first, later) <= SPLIT_APART_M and _is_split(comparison, first, later)
    ]


def _is_split(comparison: Comparison, first: int, later: int) -> bool:
    periods_s = comparison.period_s(first), comparison.period_s(later)
    plots = comparison.plots(first), comparison.plots(later)
    sizes = sorted(one.size for one in plots)
    if not abs(periods_s[0] - periods_s[1]) <= SPLIT_PERIOD * periods_s[0]:
        return False
    key = common_key(plots[0], plots[1:])
    if key is None or sizes[0] < SPLIT_PART_MIN * sizes[1]:
        return False
    scans = _nearest_s(plots[0], plots[1], key) / periods_s[0]
    near = scans[scans <= SPLIT_SCANS]
    return len(near) >= TESTED_MIN and bool(np.mean(near < 0.5) <= SPLIT_SAME_MAX)


# Time from each plot to the nearest one of another sensor of the same aircraft, s.
def _nearest_s(plots: Plots, others: Plots, key: int) -> Floats:
    def rows(one: Plots) -> pl.DataFrame:
        columns = {"name": one.keys[:, key], "time_s": one.time_s}
        return pl.DataFrame(columns).filter(pl.col("name") >= 0).sort("time_s")

    there = rows(others).with_columns(there_s=pl.col("time_s"))
    joined = rows(plots).join_asof(
        there, on="time_s", by="name", strategy="nearest", check_sortedness=False
    )
    apart = (joined["time_s"] - joined["there_s"]).abs().drop_nulls()
    return apart.to_numpy()


def check_unexplained(
    comparison: Comparison, suspects: Sequence[int], trusted: Sequence[int], names: tuple[str, ...]
) -> list[Diagnosis]:
    """Return what is wrong with sensors whose disagreement no other error explains.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    suspects, trusted : sequence of int
        Sensors that agree with no other, and those that agree with each other.
    names : tuple of str
        Names of the sensors.
    """
    found = []
    for number in suspects:
        pairs = comparison.pairs(number, trusted or suspects)
        found.append(
            check_other_rows(comparison, number, names[number], pairs, trusted=len(trusted))
            if comparison.is_radar(number)
            else _check_elsewhere(comparison, number, names[number], pairs, trusted=len(trusted))
        )
    known = [one for one in found if one is not None]
    if known or trusted or len(suspects) != 2:
        return known
    return check_contradiction(comparison, suspects[0], suspects[1], names)


# Positions of aircraft that others, which agree with each other, detect elsewhere.
def _check_elsewhere(
    comparison: Comparison, number: int, name: str, pairs: Pairs, *, trusted: int
) -> Diagnosis | None:
    share = comparison.agreement(number, pairs).share
    compared = len(np.unique(pairs.plot))
    if trusted < 2 or not are_named(pairs) or compared < TESTED_MIN or share >= UNEXPLAINED_MAX:
        return None
    own_m = comparison.tested_positions(number)[pairs.plot]
    apart_km = float(np.median(np.linalg.norm(own_m - pairs.position_m, axis=1))) / 1e3
    return Diagnosis(
        name,
        "positions_elsewhere",
        f"{name}: only {share:.0%} of its positions lie where other sensors detect the same "
        f"aircraft (they are {apart_km:.0f} km apart, median), and no single displacement, sign, "
        "unit or clock explains this: probably of another recording, or with the identities of "
        "other aircraft; check which recording it is from",
    )


def check_other_rows(
    comparison: Comparison, number: int, name: str, pairs: Pairs, *, trusted: int
) -> Diagnosis | None:
    """Diagnose a radar with a column of which each value belongs to another row.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number, name : int, str
        A radar that does not agree with others, by no error of a unit, a site or a clock.
    pairs : Pairs
        Positions by others of its aircraft, by their identities.
    trusted : int
        Other sensors that agree with each other.
    """
    share = comparison.agreement(number, pairs).share
    compared = len(np.unique(pairs.plot))
    if not are_named(pairs) or compared < TESTED_MIN:
        return None
    plots, tested = comparison.plots(number), comparison.tested(number)
    site, rows = comparison.site(number), np.searchsorted(plots.time_s, tested.time_s)
    polar = as_given(plots.range_m, plots.azimuth_deg)
    best, what, rows_away = share + SHIFTED_MORE_MIN, "", 0
    for by in (1, -1, 2, -2, 3, -3):
        other = np.clip(rows + by, 0, plots.size - 1)
        # Identities of other rows appear as ranges and azimuths of other rows.
        for column, moved in (
            ("range_m", (polar[0][other], polar[1][rows])),
            ("azimuth_deg", (polar[0][rows], polar[1][other])),
            (_IDENTITIES, (polar[0][other], polar[1][other])),
        ):
            found = polar_agreement(moved, site, pairs, compared=compared).share
            if found > max(best, AGREES_MIN):
                best, what, rows_away = found, column, by
    if what:
        of = f"the {'row' if abs(rows_away) == 1 else f'{abs(rows_away)} rows'} " + (
            "after" if (rows_away > 0) != (what == _IDENTITIES) else "before"
        )
        return Diagnosis(
            name,
            "other_rows",
            f"{name}: {_COLUMNS[what]} probably belong to other rows: with those of {of}, "
            f"{best:.0%} of its plots lie where other sensors detect the aircraft ({share:.0%} as "
            "recorded); check how the columns were joined",
        )
    if trusted < 2 or share >= UNEXPLAINED_MAX:
        return None
    # The run estimates an offset however large, and reports it.
    seen_m, _ = seen_from(site, pairs.position_m)
    nearer = polar[0] - np.median(polar[0][rows][pairs.plot] - seen_m)
    moved = nearer[rows], polar[1][rows]
    if polar_agreement(moved, site, pairs, compared=compared).share >= AGREES_MIN:
        return None
    return Diagnosis(
        name,
        "other_rows",
        f"{name}: only {share:.0%} of its plots lie where other sensors detect the same aircraft, "
        "and no single error of a unit, its site or its clock explains this: one of its columns "
        "(range, azimuth, time or identity) probably belongs to other rows, or to another sensor; "
        "check how its measurements were generated",
    )


def check_contradiction(
    comparison: Comparison, first: int, second: int, names: tuple[str, ...]
) -> list[Diagnosis]:
    """Report two radars that detect the same Mode S addresses at other places, by no known error.

    Codes and track numbers may be those of other aircraft where the coverages do not overlap.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    first, second : int
        The radars; no other sensor is compared.
    names : tuple of str
        Names of the sensors.
    """
    both, shares = (first, second), []
    for one, other in (both, both[::-1]):
        pairs = comparison.pairs(one, (other,))
        if not comparison.is_radar(one):
            return []
        key = common_key(comparison.tested(one), [comparison.plots(other)])
        aircraft = np.unique(pairs.name) if are_named(pairs) else ()
        few = len(aircraft) < _CONTRADICTED_MIN or len(np.unique(pairs.plot)) < TESTED_MIN
        if key != _ADDRESS_KEY or few:
            return []
        shares.append(comparison.agreement(one, pairs).share)
    if max(shares) >= UNEXPLAINED_MAX:
        return []
    return [
        Diagnosis(
            names[first],
            "contradiction",
            f"{names[first]} and {names[second]} detect the same {len(aircraft)} aircraft (by "
            f"mode_s_address) at different places: {max(shares):.0%} of their plots agree, and no "
            "single error of a unit, a site or a clock explains this; check whether the sensors "
            "file is that of these radars",
        )
    ]
