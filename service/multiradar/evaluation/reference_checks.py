"""Checks of a reference: matches, rejected rows, independence, clocks, units of heights."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.measures.update_errors import UpdateErrors
from multiradar.evaluation.measures.update_times import UPDATE_TIME, with_ids, with_update_times
from multiradar.evaluation.overlap import cut_short, mostly_unknown, outside, rarely_matched
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Reference, RowCounts, Tracks
from multiradar_schemas.measurements.units import FOOT_M
from multiradar_schemas.sensors.sensor import Sensor

#: Fraction of the updates by radars that have a plot at their time in the recording of the tracks.
SAME_MIN = 0.5
#: An offset along the course from this time on, s, with this fraction of the updates on one side,
#: is one of a clock: the lag of a tracker in turns is smaller, and of both signs elsewhere.
CLOCK_MIN_S, ONE_SIDE_MIN = 1.0, 0.8
#: Slower aircraft show no clock, m/s.
SPEED_MIN_MPS = 50.0
#: Fewer updates give no diagnosis.
UPDATES_MIN = 100
#: Height in the unit over height in metres, by unit.
HEIGHT_UNITS = {
    "feet": 1.0 / FOOT_M,
    "flight levels (hundreds of feet)": 1.0 / 30.48,
    "hundreds of metres": 0.01,
    "kilometres": 0.001,
}
#: Deviation of the median ratio of heights from that of a unit.
UNIT_WITHIN = 0.03
#: Fraction of the reference outside the coverage that gives a warning.
UNCOVERED_MIN = 0.5
#: Rejected rows named in a message.
NAMED_MAX = 3
#: Lower aircraft show no unit, m.
HEIGHT_MIN_M = 300.0


def poorly_matched(
    tracks: Tracks, reference: Reference, instants: Instants, settings: EvaluationSettings
) -> list[str]:
    """Return warnings where tracks and reference match in a part only.

    Parameters
    ----------
    tracks, reference : Tracks, Reference
        Tracks and reference.
    instants : Instants
        Their assignment.
    settings : EvaluationSettings
        Gate, and whether the reference may be incomplete.
    """
    found = [
        *cut_short(tracks, reference),
        *outside(tracks, reference, settings.gate_m),
    ]
    found = found or rarely_matched(instants.track_of, settings.gate_m)
    if not settings.partial:
        aircraft = len(reference.names)
        found += mostly_unknown(instants.track, instants.aircraft_of, aircraft)
    return found


def of_another_recording(
    tracks: Tracks, measured: pl.DataFrame, sensors: Sequence[Sensor], given: Path
) -> list[str]:
    """Return what is wrong if measurements are not those from which tracks were formed.

    Parameters
    ----------
    tracks : Tracks
        The tracks.
    measured : DataFrame
        Columns ``time_s`` and ``sensor_id`` of a recording.
    sensors : sequence of Sensor
        Sensors of the tracks, as far as known.
    given : Path
        The recording, for the message.

    Returns
    -------
    list of str
        Empty where at least `SAME_MIN` of the updates by sensors of the recording, or of all
        updates if it has none of their sensors, have a measurement at their time.
    """
    used = tracks.measured
    updates = pl.DataFrame({UPDATE_TIME: tracks.time_s[used], "sensor_id": tracks.sensor_id[used]})
    updates, measured = with_ids(updates, sensors), with_update_times(measured, sensors)
    theirs, own = (sorted(one["sensor_id"].unique().to_list()) for one in (measured, updates))
    known = updates.filter(pl.col("sensor_id").is_in(theirs))
    share = len(known.join(measured, on=updates.columns, how="semi")) / max(len(known), 1)
    if not own or share >= SAME_MIN:
        return []
    return [
        f"{given}: {share:.0%} of the updates of the tracks by its sensors have a measurement at "
        f"their time (its sensors: {', '.join(theirs) or 'none'}; those of the tracks: "
        f"{', '.join(own)}): probably another recording; specify the measurements from which the "
        "tracks were formed"
    ]


def of_other_sensors(
    tracks: Tracks, radars: Collection[str], names: Collection[str], given: Path
) -> list[str]:
    """Return what is wrong if sensors of the tracks are not in a sensors file.

    Parameters
    ----------
    tracks : Tracks
        The tracks.
    radars : collection of str
        Radars of their recording, as far as known: other sensors have no site and no coverage.
    names : collection of str
        All names of the sensors of the file.
    given : Path
        The file, for the message.
    """
    used = set(tracks.sensor_id[tracks.measured].tolist())
    missing = sorted(used & set(radars) - set(names))
    if not used or (used & set(names) and not missing):
        return []
    if missing and used & set(names):
        return [
            f"{given}: {', '.join(missing)} {'is' if len(missing) == 1 else 'are'} not in this "
            "file, but updated tracks: coverage and differences by radar are incomplete; specify "
            "the sensors file of the tracks"
        ]
    return [
        f"{given}: none of the sensors of the tracks ({', '.join(sorted(used))}) is in this file, "
        f"which has {', '.join(sorted(names))}; specify the sensors file of the tracks"
    ]


def wide_gate(reference: Reference, settings: EvaluationSettings) -> list[str]:
    """Return a warning where the gate is wider than aircraft are apart: any track matches one.

    Parameters
    ----------
    reference : Reference
        The reference.
    settings : EvaluationSettings
        The gate; the default one is not too wide.
    """
    if settings.gate_m <= EvaluationSettings().gate_m:
        return []
    # Of the aircraft that are known at one time.
    middle_s = float(np.median(reference.time_s))
    near = np.abs(reference.time_s - middle_s) <= reference.gap_s
    _, first = np.unique(reference.aircraft[near], return_index=True)
    place = reference.position_m[near][first]
    if len(place) < 2:
        return []
    apart_m = np.linalg.norm(place[:, None] - place[None], axis=2)
    np.fill_diagonal(apart_m, np.inf)
    nearest_m = float(np.median(apart_m.min(axis=1)))
    if settings.gate_m <= nearest_m:
        return []
    return [
        f"gate {settings.gate_m:.0f} m: half of the aircraft are within {nearest_m:.0f} m of "
        "another one, so that tracks of other aircraft are accepted as matches; reduce the gate"
    ]


def clock_offset(tracks: Tracks, errors: UpdateErrors) -> list[str]:
    """Return a warning where the tracks are ahead of the reference, or behind it, in time.

    Parameters
    ----------
    tracks : Tracks
        The tracks evaluated.
    errors : UpdateErrors
        Errors of their updates.

    Returns
    -------
    list of str
        Empty where the median offset along the course is less than `CLOCK_MIN_S`, or not on one
        side.
    """
    speed_mps = np.hypot(*tracks.ground_mps[errors.update].T) - errors.speed_mps
    used = np.isfinite(errors.along_m) & (speed_mps >= SPEED_MIN_MPS)
    if np.count_nonzero(used) < UPDATES_MIN:
        return []
    ahead_s = errors.along_m[used] / speed_mps[used]
    offset_s = float(np.median(ahead_s))
    if abs(offset_s) < CLOCK_MIN_S or np.mean(ahead_s * offset_s > 0.0) < ONE_SIDE_MIN:
        return []
    order = "ahead of" if offset_s > 0.0 else "behind"
    return [
        f"the tracks are {abs(offset_s):.1f} s {order} the reference along track (median of "
        f"{len(ahead_s)} updates): check the clocks of the reference and of the sensors"
    ]


def height_unit(tracks: Tracks, errors: UpdateErrors) -> list[str]:
    """Return a warning where the heights of tracks and reference have different units.

    Parameters
    ----------
    tracks : Tracks
        The tracks evaluated.
    errors : UpdateErrors
        Errors of their updates.

    Returns
    -------
    list of str
        Empty where the median ratio of the heights is that of no unit of `HEIGHT_UNITS`.
    """
    own_m = tracks.height_m[errors.update]
    known_m = own_m - errors.height_m
    used = np.isfinite(own_m) & np.isfinite(known_m) & (np.maximum(own_m, known_m) >= HEIGHT_MIN_M)
    used &= np.minimum(own_m, known_m) > 0.0
    if np.count_nonzero(used) < UPDATES_MIN:
        return []
    ratio = float(np.median(known_m[used] / own_m[used]))
    for unit, factor in HEIGHT_UNITS.items():
        for whose, found in (("reference", ratio), ("tracks", 1.0 / ratio)):
            if abs(found / factor - 1.0) <= UNIT_WITHIN:
                return [f"heights of the {whose} are probably in {unit}: they must be in metres"]
    return []


def shared_sensors(tracks: Tracks, reporters: Sequence[str]) -> list[str]:
    """Return a warning where the tracks were updated by the sensors of the reference.

    Parameters
    ----------
    tracks : Tracks
        The tracks evaluated.
    reporters : sequence of str
        Sensors whose reports are the reference.

    Returns
    -------
    list of str
        Empty where they have none in common.
    """
    used = np.isin(tracks.sensor_id, list(reporters))
    if not used.any():
        return []
    names = ", ".join(sorted(set(tracks.sensor_id[used].tolist())))
    return [
        f"{used.mean():.0%} of the updates are from {names}, which is also the reference, so the "
        "errors are underestimated: run `track` without this source (`--kinds radar`)"
    ]


def rejected_rows(counts: RowCounts) -> list[str]:
    """Return a warning where rows of the reference are rejected.

    Parameters
    ----------
    counts : RowCounts
        Disposition of the rows.

    Returns
    -------
    list of str
        Empty without rejects; else one sentence with the first `NAMED_MAX` of them.
    """
    if not counts.rejects:
        return []
    named = "; ".join(map(str, counts.rejects[:NAMED_MAX]))
    more = len(counts.rejects) - NAMED_MAX
    rest = f"; and {more} more (--json, --html)" if more > 0 else ""
    return [f"{len(counts.rejects)} of {counts.read} reference rows are rejected: {named}{rest}"]


def uncovered_rows(counts: RowCounts) -> str:
    """Return how many positions of the reference are outside the coverage, and why."""
    lost = counts.uncovered
    parts = [
        f"{number} {why}"
        for number, why in (
            (lost.time, "outside the time span of the plots"),
            (lost.range, "out of range"),
            (lost.horizon, "below the horizon"),
        )
        if number
    ]
    return (
        f"{lost.total} of {counts.accepted} reference positions lie outside the coverage of the "
        f"sensors ({', '.join(parts)}) and are not compared; use --whole-reference (Python: "
        "whole_reference=True) to compare them"
    )


def mostly_uncovered(counts: RowCounts) -> list[str]:
    """Return a warning where most of the reference lies outside the coverage of the sensors.

    Parameters
    ----------
    counts : RowCounts
        Disposition of the rows.

    Returns
    -------
    list of str
        Empty where less than `UNCOVERED_MIN` of the accepted rows lies outside.
    """
    few = counts.uncovered.total < UNCOVERED_MIN * counts.accepted
    return [] if few or not counts.uncovered.total else [uncovered_rows(counts)]
