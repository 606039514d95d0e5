"""Nenartovich and Isakov: a trajectory from angles alone, beside the one from places made of them.

Columns of a row: `scene`, `scheme` (`bearings`, `places` or `places led on`), `quantity`, `time_s`
(null for the whole time after the start), `runs`, `value`, `expected`, `band_low`, `band_high`.
"""

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student_t

from multiradar.report.content import Table, Value
from multiradar.research.studies.bearing_only.places import triangulated
from multiradar.research.studies.bearing_only.plots import plots
from multiradar.research.studies.bearing_only.runs import (
    BEARINGS,
    DURATION_S,
    LED_ON,
    PLACES,
    SCENES,
    SETTLED_S,
    Filtered,
    Floats,
    fused,
    look,
)
from multiradar.research.studies.catalogue import BEARING_ONLY
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult, step_counter

Row = dict[str, Value]

#: Probability that NEES over all runs at one time lies in its band.
BAND = 0.95
# So many runs tell how far they lie apart.
_RUNS_OF_BAND_MIN = 2
#: Velocities are looked at once while they are still being found, s.
EARLY_S = 25.0
SUMMARY = (
    "Direction finders, or radars that jamming has robbed of the range, see an aircraft from "
    "several places. Each angle can correct the trajectory as it comes, or the angles of a turn "
    "can be made a place first. What is the difference?"
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Track the same angles in both ways.

    Parameters
    ----------
    options : StudyOptions
        `runs` flights of each scene, and the seed.
    progress : callable
        Told how many scenes are done.

    Returns
    -------
    StudyResult
        Rows as in docs/studies.md.

    References
    ----------
    Nenartovich, Isakov, the section on the simulation: the gain of 1.5 to 2.
    """
    runs = BEARING_ONLY.complete(options).runs
    assert runs is not None
    tick = step_counter(progress, len(SCENES))
    # Each scene has draws of its own.
    seeds = np.random.SeedSequence(options.seed).spawn(len(SCENES))
    rows: list[Row] = []
    for scene, seed in zip(SCENES, seeds, strict=True):
        looks = look(scene, runs, DURATION_S, np.random.Generator(np.random.PCG64(seed)))
        schemes = {BEARINGS: fused(looks)}
        if not scene.ranging:
            schemes[PLACES] = triangulated(looks, led_on=False)
            schemes[LED_ON] = triangulated(looks, led_on=True)
        for name, found in schemes.items():
            rows += _rows(scene.name, name, found)
        rows += _gains(scene.name, rows)
        tick()
    return StudyResult(
        study=BEARING_ONLY.name,
        title=BEARING_ONLY.title,
        seed=options.seed,
        rows=rows,
        tables=[_table(rows), _consistency_table(rows)],
        plots=plots(rows),
        notes=_notes(rows),
        summary=SUMMARY,
        options={"runs": runs},
    )


def _rows(scene: str, scheme: str, found: Filtered) -> list[Row]:
    d = found.error.shape[-1] // 2
    settled = found.time_s >= SETTLED_S
    position = np.square(found.error[..., :d]).sum(axis=-1)
    velocity = np.square(found.error[..., d:]).sum(axis=-1)
    of_runs = _nees(found)
    nees = of_runs.mean(axis=1)
    runs = found.error.shape[1]
    known = {"scene": scene, "scheme": scheme, "runs": runs}
    whole: dict[str, float] = {
        "position_rms_m": float(np.sqrt(position[settled].mean())),
        "velocity_rms_mps": float(np.sqrt(velocity[settled].mean())),
        "nees": float(nees[settled].mean()),
    }
    if scheme == BEARINGS:
        whole["crossing"] = float(found.crossing[-1].mean())
    rows = [_row(known, quantity, None, value) for quantity, value in whole.items()]
    rows[list(whole).index("nees")] |= _band_of_runs(of_runs[settled].mean(axis=0))
    low, high = chi2.ppf([0.5 - BAND / 2.0, 0.5 + BAND / 2.0], 2 * d * runs) / (2 * d * runs)
    inside = (nees >= low) & (nees <= high)
    rows.append(_row(known, "nees_inside", None, float(inside[settled].mean())))
    for place, time_s in enumerate(found.time_s.tolist()):
        for quantity, squares in (("position_rms_m", position), ("velocity_rms_mps", velocity)):
            rms = float(np.sqrt(squares[place].mean()))
            rows.append(_row(known, quantity, time_s, rms))
        of_time = _row(known, "nees", time_s, float(nees[place]))
        rows.append(of_time | {"expected": 1.0, "band_low": low, "band_high": high})
    return rows


# The band of the mean over runs and times. The times of one run go together, so that they do not
# count: the runs do, by how far their own means lie apart.
def _band_of_runs(nees: Floats) -> Row:
    runs = len(nees)
    if runs < _RUNS_OF_BAND_MIN:
        return {"expected": 1.0}
    half = float(student_t.ppf(0.5 + BAND / 2.0, runs - 1) * nees.std(ddof=1) / np.sqrt(runs))
    return {"expected": 1.0, "band_low": 1.0 - half, "band_high": 1.0 + half}


# Over the dimension, at each time, of each run.
def _nees(found: Filtered) -> Floats:
    solved = np.linalg.solve(found.covariance, found.error[..., None])[..., 0]
    return np.asarray((found.error * solved).sum(axis=-1) / found.error.shape[-1])


def _row(known: Row, quantity: str, time_s: float | None, value: float) -> Row:
    return {
        **known,
        "quantity": quantity,
        "time_s": time_s,
        "value": value,
        "expected": None,
        "band_low": None,
        "band_high": None,
    }


# How many times larger the errors of places are than those of bearings.
def _gains(scene: str, rows: list[Row]) -> list[Row]:
    found = []
    for scheme in (PLACES, LED_ON):
        for name in ("position", "velocity"):
            quantity = "position_rms_m" if name == "position" else "velocity_rms_mps"
            other = _value(rows, scene, scheme, quantity)
            own = _value(rows, scene, BEARINGS, quantity)
            if other is not None and own is not None:
                runs = next(row["runs"] for row in rows if row["scene"] == scene)
                known: Row = {"scene": scene, "scheme": scheme, "runs": runs}
                found.append(_row(known, f"{name}_gain", None, other / own))
    return found


def _value(rows: list[Row], scene: str, scheme: str, quantity: str) -> float | None:
    for row in rows:
        asked = (row["scene"], row["scheme"], row["quantity"], row["time_s"])
        if asked == (scene, scheme, quantity, None):
            return float(row["value"] or 0.0)
    return None


def _table(rows: list[Row]) -> Table:
    cells = []
    for scene in SCENES:
        for scheme in (BEARINGS, PLACES, LED_ON):
            if _value(rows, scene.name, scheme, "position_rms_m") is None:
                continue
            cells.append(
                (
                    scene.name, scheme,
                    *(
                        _value(rows, scene.name, scheme, quantity)
                        for quantity in (
                            "position_rms_m", "velocity_rms_mps", "position_gain", "velocity_gain",
                        )
                    ),
                )
            )  # fmt: skip
    return Table(
        title="Errors from angles as they come, and from places made of them",
        header=(
            "scene", "scheme", "position, m", "velocity, m/s", "times worse", "in velocity",
        ),
        rows=tuple(cells),
        caption=f"Root mean square from {SETTLED_S:g} s on. "
        + "; ".join(f"{scene.name}: {scene.purpose}" for scene in SCENES)
        + ".",
    )  # fmt: skip


def _consistency_table(rows: list[Row]) -> Table:
    cells = []
    for scene in SCENES:
        for scheme in (BEARINGS, PLACES, LED_ON):
            nees = _value(rows, scene.name, scheme, "nees")
            if nees is None:
                continue
            band = _band(rows, scene.name, scheme)
            inside = _value(rows, scene.name, scheme, "nees_inside")
            crossing = _value(rows, scene.name, scheme, "crossing")
            cells.append((scene.name, scheme, nees, *band, 100.0 * float(inside or 0.0), crossing))
    return Table(
        title="Whether each scheme is as good as it says",
        header=(
            "scene", "scheme", "NEES / dimension", "band from", "to", "times in their band, %",
            "crossing",
        ),
        rows=tuple(cells),
        caption="The band of 95 % is that of the mean over runs and times, by how far the means of "
        "the runs lie apart. At each time NEES has a band of its own, but the times of a run go "
        "together: they may be outside for long in some seeds and hardly ever in others. "
        "Crossing: by how many of their errors the lines of sight cross at the end, "
        "condition (10); 3 are asked for.",
    )  # fmt: skip


def _band(rows: list[Row], scene: str, scheme: str) -> tuple[float | None, float | None]:
    for row in rows:
        asked = (row["scene"], row["scheme"], row["quantity"], row["time_s"])
        if asked == (scene, scheme, "nees", None) and row["band_low"] is not None:
            return float(row["band_low"]), float(row["band_high"] or 0.0)
    return None, None


# The first time after `EARLY_S`, and how many times larger errors of velocity are from places then.
def _early_gains(rows: list[Row], scene: str) -> tuple[float, list[float]]:
    found = {
        (row["scheme"], row["time_s"]): float(row["value"] or 0.0)
        for row in rows
        if (row["scene"], row["quantity"]) == (scene, "velocity_rms_mps")
    }
    time_s = min(float(time) for _, time in found if time is not None and float(time) >= EARLY_S)
    own = found[BEARINGS, time_s]
    return time_s, [found[scheme, time_s] / own for scheme in (PLACES, LED_ON)]


def _notes(rows: list[Row]) -> list[str]:
    scene, missed = SCENES[0].name, SCENES[-1].name
    gains = [
        _value(rows, one, scheme, quantity) or 0.0
        for one, quantity in (
            (scene, "position_gain"),
            (missed, "position_gain"),
            (missed, "velocity_gain"),
        )
        for scheme in (PLACES, LED_ON)
    ]
    early_s, early = _early_gains(rows, scene)
    return [
        "The paper tells neither its geometry nor its usual scheme. `places` takes the angles of a "
        "turn as if they were of one moment, `places led on` first leads each on to the moment of "
        "the last by the rate since the turn before; both by least squares with the covariance of "
        "the crossing, and the same Kalman filter.",
        f"In the scene {scene} places are {gains[0]:.1f} times worse, led on {gains[1]:.1f} times: "
        "what the paper reports as 1.5 to 2 comes of the moments of the angles, and of turns in "
        "which one source alone sees the aircraft and makes no place. Where sources miss it every "
        f"other time (scene {missed}, the same looks in all runs; other seeds miss others and come "
        f"to 1.2 to 2.8) places are {gains[2]:.1f} and {gains[3]:.1f} times worse, their "
        f"velocities {gains[4]:.1f} and {gains[5]:.1f} times. Where all sources look at "
        "once, three lines and their crossing say the same, and the two ways differ by the bend of "
        "the lines alone.",
        "The paper reports as much for the velocity. Where nothing is missed there is less: once "
        "the velocity is found, most of its errors are what the aircraft does, not what is "
        f"measured. While it is found, after {early_s:.0f} s of the scene {scene}, they are "
        f"{early[0]:.1f} times as large from places, led on {early[1]:.1f} times.",
        "Angles that are led on are used twice, so that the errors of places that follow each "
        "other go together; what the filter claims is then too large or too small.",
    ]
