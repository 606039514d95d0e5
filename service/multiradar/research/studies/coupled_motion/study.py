"""The motion models of Vasiliev and Mattis: figures 1 and 3, and their accuracy in a filter.

Three parts, see the column `part` of a row:

figure
    Trajectories of model (2) with a = 1 and 2 m/s² and of model (5) with a = 1 m/s² and v_K = 3 and
    6 °/s, and statistics of many such trajectories.
heading
    Root mean square acceleration along and across the track of one interval, by heading. The
    parameters of (5) apply to every heading; those of (2) only when they are equal, and then
    without a difference of along and across; those of the relative-speed variant never.
tracking
    Flights of (2), the relative-speed variant and (5), tracked by filters with each of (2),
    relative, (7), (5) and constant velocity with white acceleration. Every filter knows the same
    accelerations of the kind of aircraft, in the terms of its model.

Columns of a row: `part`; `model` and `setting` (the motion and its parameters); `filter`
(tracking only); `quantity`; `run`, `time_s`, `heading_deg` where the quantity has them, else null;
`value`; `expected` (by theory, or reported by the filter); `band_low`, `band_high` (band of `value`
for a correct `expected`: 99.9 % for headings, 95 % for NEES).

Quantities: `east_m`, `north_m` of a drawn trajectory; over many of them `acceleration_along_mps2`,
`acceleration_across_mps2`, `speed_change_mps` and `turned_deg`, root mean square; of a filter
`position_rms_m` and `velocity_rms_mps` (expected: reported by it) and `nees` (per dimension:
expected 1), with `time_s` at that time, with `heading_deg` for the flights with an initial heading
within 7.5° of it, with neither for the whole flight except its first fifth.
"""

from collections.abc import Callable, Iterable

import numpy as np

from multiradar.report.content import Table, Value
from multiradar.research.studies.catalogue import COUPLED_MOTION
from multiradar.research.studies.coupled_motion.figures import heading_spreads, realise
from multiradar.research.studies.coupled_motion.models import (
    DRAWN,
    INITIAL_SPEED_MPS,
    INTERVAL_S,
    TRACKED,
    Scenario,
    filter_model,
)
from multiradar.research.studies.coupled_motion.plots import plots
from multiradar.research.studies.coupled_motion.rows import (
    Row,
    figure_rows,
    heading_rows,
    tracking_rows,
)
from multiradar.research.studies.coupled_motion.tracking import (
    POSITION_SIGMA_M,
    Floats,
    Tracked,
    batches,
    fly,
    track,
)
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult, step_counter

#: Quantity, title and caption of the tables of filters by motion.
TABLES = (
    (
        "velocity_rms_mps",
        "Velocity error of each filter by motion model, m/s",
        "RMS over all flights, excluding the first fifth of each flight. Positions are measured "
        f"every {INTERVAL_S:g} s, with a sigma of {POSITION_SIGMA_M:g} m in each coordinate.",
    ),
    ("position_rms_m", "Position error of each filter by motion model, m", ""),
    (
        "nees",
        "NEES / 6 of each filter by motion model",
        "1 for a consistent filter, above 1 if its covariance is too small.",
    ),
)

SUMMARY = (
    "Aircraft accelerate along and perpendicular to their velocity, not along the coordinate axes "
    "of the tracker. How does a model with random acceleration along fixed axes (2) differ from a "
    "model with random acceleration in the velocity frame (5), and how accurate are filters based "
    "on these models?"
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Draw the figures, sample accelerations by heading, and track flights of each model.

    Parameters
    ----------
    options : StudyOptions
        `runs` flights for each tracked motion; `filters` of `models.FILTERS`; `duration_s` of
        every trajectory.
    progress : callable
        Called with the number of completed parts.

    Returns
    -------
    StudyResult
        Rows as described in this module.

    Raises
    ------
    UnknownFilterError
        Unknown filter.
    ConfigurationError
        A duration outside the bounds of the study.

    References
    ----------
    Vasiliev, Mattis, equations (2), (5) and (7), and its figures 1 and 3.
    """
    chosen = COUPLED_MOTION.complete(options)
    runs, names, duration_s = chosen.runs, chosen.filters, chosen.duration_s
    assert runs is not None
    assert names is not None
    assert duration_s is not None
    steps = round(duration_s / INTERVAL_S)
    parts = batches(runs, steps)
    tick = step_counter(progress, len(DRAWN) + 1 + len(TRACKED) * len(names) * len(parts))
    # Each part has its own random stream: a choice of filters changes nothing else.
    seeds = iter(np.random.SeedSequence(chosen.seed).spawn(len(DRAWN) + 1 + len(TRACKED)))
    rows: list[Row] = []
    for scenario in DRAWN:
        rows += figure_rows(scenario, realise(scenario, steps, _generator(next(seeds))))
        tick()
    for spread in heading_spreads(_generator(next(seeds))):
        rows += heading_rows(spread)
    tick()
    for scenario in TRACKED:
        rng = _generator(next(seeds))
        rows += _tracked(scenario, names, parts, steps=steps, rng=rng, tick=tick)
    return StudyResult(
        study=COUPLED_MOTION.name,
        title=COUPLED_MOTION.title,
        seed=chosen.seed,
        rows=rows,
        tables=[*_tracking_tables(rows, names), _figure_table(rows)],
        plots=plots(rows),
        notes=_notes(runs, steps),
        summary=SUMMARY,
        options={"runs": runs, "filters": list(names), "duration_s": steps * INTERVAL_S},
    )


# One batch of flights at a time, the same for every filter.
def _tracked(
    scenario: Scenario,
    names: tuple[str, ...],
    parts: list[Floats],
    *,
    steps: int,
    rng: np.random.Generator,
    tick: Callable[[], None],
) -> list[Row]:
    found: dict[str, Tracked] = {}
    for headings_rad in parts:
        flights = fly(scenario, headings_rad, steps, rng)
        for name in names:
            part = track(filter_model(name, scenario, flights.start), flights)
            found[name] = found[name] + part if name in found else part
            tick()
    every = np.concatenate(parts)
    return [row for name in names for row in tracking_rows(scenario, name, found[name], every)]


def _generator(seed: np.random.SeedSequence) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def _tracking_tables(rows: list[Row], names: tuple[str, ...]) -> list[Table]:
    return [
        Table(title, ("motion", "parameters", *names), tuple(_by_motion(rows, quantity)), caption)
        for quantity, title, caption in TABLES
    ]


# Of each motion its name, its parameters, and the value of each filter.
def _by_motion(rows: list[Row], quantity: str) -> Iterable[tuple[Value, ...]]:
    found: dict[tuple[Value, Value], list[Value]] = {}
    for row in rows:
        is_mean = row["time_s"] is None and row["heading_deg"] is None
        if row["part"] == "tracking" and is_mean and row["quantity"] == quantity:
            found.setdefault((row["model"], row["setting"]), []).append(row["value"])
    return ((*key, *values) for key, values in found.items())


def _figure_table(rows: list[Row]) -> Table:
    found: dict[tuple[str, str], dict[str, Row]] = {}
    for row in rows:
        if row["part"] == "figure" and row["run"] is None:
            key = (str(row["model"]), str(row["setting"]))
            found.setdefault(key, {})[str(row["quantity"])] = row
    return Table(
        "Statistics of the trajectories of figures 1 and 3",
        (
            "motion",
            "parameters",
            "along, m/s²",
            "across, m/s²",
            "speed change, m/s",
            "course change, °",
        ),
        tuple((*key, *(row["value"] for row in of.values())) for key, of in found.items()),
        "RMS values of the acceleration along and across the track in the horizontal plane, and "
        "of the changes of ground speed and course between start and end.",
    )


def _notes(runs: int, steps: int) -> list[str]:
    return [
        "The paper does not give the interval, the number of steps or the initial speed used for "
        f"its figures. Here T = {INTERVAL_S:g} s, {steps} steps, {INITIAL_SPEED_MPS:g} m/s, "
        "initial headings evenly spaced over the circle, and a climb angle of 2°; vertically, a_z "
        "= 0.2 m/s² and v_φ = 0.1 °/s.",
        f"Tracking: {runs} flights of each motion model, the same for every filter. Each filter is "
        "given the RMS accelerations of its aircraft along and across the track and vertically. "
        "Models with fixed axes use the root mean square of the along-track and cross-track "
        "accelerations for both horizontal axes; velocity-frame models use these accelerations "
        "directly, divided by the initial speed to obtain rates.",
        "The parameters of (5) are valid for every heading, the parameters of (2) only if a_x = "
        "a_y. A filter with (2) is then consistent on average, but cannot represent a lateral "
        "acceleration that is larger than the longitudinal acceleration. The relative-speed model "
        "has no process noise along an axis on which the initial speed is zero: at headings near "
        "the axes, its filter is overconfident and loses track of turning aircraft.",
        "The filter with (7) takes the direction of its process noise from the estimated velocity. "
        "At a turn rate of 6 °/s, this direction is wrong by about 10°: part of the strong "
        "cross-track noise is then applied in the wrong direction, and the covariance is too "
        "small. The filter with (5), in which the course is a state, is nearly consistent. With "
        "white acceleration the position also varies at random within an interval, unlike in the "
        "models of the paper.",
    ]
