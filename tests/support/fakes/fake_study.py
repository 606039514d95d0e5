"""A fake study for tests of the command and the report."""

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import InputError
from multiradar.report.content import Plot, Series, Table
from multiradar.research.studies.catalogue import StudyEntry
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult

#: Text that breaks pages or terminals without escaping.
HOSTILE = "<script>alert('1')</script> & \"[bold]x[/]\" $x^2$"

ENTRY = StudyEntry(
    name="fake",
    title="A fake study",
    purpose="Give the same few figures.",
    module="support.fakes.fake_study",
    runs=3,
    duration_s=10.0,
    filters=("joint", "two-stage", "ci"),
)
#: The same without options.
FIXED = StudyEntry(
    name="fixed",
    title="A fixed study",
    purpose="Take no option.",
    module="support.fakes.fake_study",
)
#: The seed with which the study fails.
FAILING_SEED = 13
#: The seed of an interruption by Ctrl-C.
STOPPED_SEED = 14


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Return a result of every kind of series and cell."""
    if options.seed == FAILING_SEED:
        msg = "expected a luckier seed, was 13"
        raise InputError(msg)
    if options.seed == STOPPED_SEED:
        raise KeyboardInterrupt
    for done in range(4):
        progress(done, 3)
    filters = options.filters or ()
    time_s = np.linspace(0.0, options.duration_s or 1.0, 50)
    return StudyResult(
        study="fake",
        title=f"A fake study {HOSTILE}",
        seed=options.seed,
        rows=[
            {"filter": name, "error_m": np.float64(rank), "missing": float("nan"), "drift": False}
            for rank, name in enumerate(filters)
        ],
        tables=[
            Table(
                title="Main table",
                header=("filter", "error, m"),
                rows=tuple((name, 0.2512 * rank) for rank, name in enumerate(filters)),
                caption=HOSTILE,
            ),
            Table("Second table", ("what", "is it"), ((HOSTILE, True), (None, False))),
        ],
        plots=[_errors(time_s, filters), *(_map(side) for side in "ab")],
        notes=[HOSTILE, "A second note."],
        summary="What was studied.",
        options={
            "runs": options.runs,
            "duration_s": options.duration_s,
            "filters": list(filters),
        },
    )


def _errors(time_s: NDArray[np.float64], filters: tuple[str, ...]) -> Plot:
    falling = 100.0 * np.exp(-time_s)
    lines = [Series(name, time_s, falling * (1 + i)) for i, name in enumerate(filters)]
    series = (
        Series("band", time_s, falling * 0.5, "band", falling * 2.0),
        Series("expected", time_s, np.ones(len(time_s)), "reference"),
        Series("theory", time_s, falling, "dashed", key="ink"),
        Series("measured", time_s, falling, "points"),
        Series("published", time_s, falling, "rings"),
        *lines,
    )
    return Plot(HOSTILE, "time, s", "error, m", series, y_scale="log", caption=HOSTILE)


def _map(side: str) -> Plot:
    angle = np.linspace(0.0, 3.0, 40)
    track = Series(HOSTILE, np.cos(angle), np.sin(angle), "track")
    return Plot(side, "x, km", "y, km", (track,), equal_axes=True, group="Maps")
