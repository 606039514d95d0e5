"""The example of Korobochkin: the plane of a circle, whether there is one, and helices.

Columns of a row: `part` (`example`, `rejection` or `helix`), `source`, `radius_m`, `climb_mps`,
`time_s`, `quantity`, `runs`, `value`, `expected`, `band_low`, `band_high`, `printed`; null where a
quantity has none.
"""

import numpy as np

from multiradar.report.content import Table, Value
from multiradar.research.studies.catalogue import MANOEUVRE_PLANE
from multiradar.research.studies.manoeuvre_plane.plots import plots
from multiradar.research.studies.manoeuvre_plane.runs import (
    CLIMBS_MPS,
    HELIX_RADII_M,
    PRINTED,
    RADII_M,
    SOURCES,
    SPEED_MPS,
    TIMES_S,
    Case,
    normal_error_rad,
    planes,
    share_band,
)
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult, step_counter
from multiradar.restoration.geometry.manoeuvre_plane import LEVEL, ManoeuvrePlane

Row = dict[str, Value]

#: Refusals are counted over so many times the runs: at 0.3 % a hundred say little.
REJECTION_FACTOR = 30
SUMMARY = (
    "An aircraft flies a circle in a vertical plane; its position is measured a hundred times a "
    "second with errors of 25 m on each axis. How well is the plane known, how often is a plane "
    "motion refused, and is a helix told from a circle?"
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Lay planes through circles and helices.

    Parameters
    ----------
    options : StudyOptions
        `runs` of each case, and the seed.
    progress : callable
        Told how many cases are done.

    Returns
    -------
    StudyResult
        Rows as in docs/studies.md.

    References
    ----------
    Korobochkin, the section on the example, figures 2 to 4, and equation (1.17).
    """
    runs = MANOEUVRE_PLANE.complete(options).runs
    assert runs is not None
    circles = [Case(SOURCES[0], radius, 0.0) for radius in RADII_M]
    others = [Case(source, RADII_M[0], 0.0) for source in SOURCES]
    helices = [Case(SOURCES[0], radius, climb) for radius in HELIX_RADII_M for climb in CLIMBS_MPS]
    tick = step_counter(progress, len(circles) + len(others) + len(helices))
    # Each case has draws of its own.
    seeds = iter(np.random.SeedSequence(options.seed).spawn(len((*circles, *others, *helices))))
    rows: list[Row] = []
    for case in circles:
        rows += _example(case, planes(case, TIMES_S, runs, _generator(next(seeds))))
        tick()
    for case in others:
        count = REJECTION_FACTOR * runs
        found = planes(case, TIMES_S[-1:], count, _generator(next(seeds)))
        rows += _rejection(case, _determined(found, 0))
        tick()
    for case in helices:
        found = planes(case, TIMES_S[-1:], runs, _generator(next(seeds)))
        rows += _helix(case, _determined(found, 0))
        tick()
    return StudyResult(
        study=MANOEUVRE_PLANE.name,
        title=MANOEUVRE_PLANE.title,
        seed=options.seed,
        rows=rows,
        tables=[_errors_table(rows), _rejection_table(rows), _helix_table(rows)],
        plots=plots(rows),
        notes=_notes(rows),
        summary=SUMMARY,
        options={"runs": runs},
    )


def _generator(seed: np.random.SeedSequence) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


# The planes at one of the times, of the runs whose points determine one.
def _determined(found: list[list[ManoeuvrePlane | None]], place: int) -> list[ManoeuvrePlane]:
    return [plane for run in found if (plane := run[place]) is not None]


def _row(case: Case, runs: int, time_s: float, quantity: str, value: Value) -> Row:
    return {
        "part": "",
        "source": case.source,
        "radius_m": case.radius_m,
        "climb_mps": case.climb_mps,
        "time_s": time_s,
        "quantity": quantity,
        "runs": runs,
        "value": value,
        "expected": None,
        "band_low": None,
        "band_high": None,
        "printed": None,
    }


def _example(case: Case, found: list[list[ManoeuvrePlane | None]]) -> list[Row]:
    rows = []
    for place, time_s in enumerate(TIMES_S):
        one = _determined(found, place)
        # The plane of the circle goes through the origin.
        errors = {
            "normal_error_mrad": [1e3 * normal_error_rad(plane) for plane in one],
            "distance_error_m": [abs(plane.distance_m) for plane in one],
        }
        values: dict[str, Value] = {
            "determined_share": len(one) / len(found),
            **{name: _mean(many) for name, many in errors.items()},
            "printed_statistic": _mean([plane.printed_statistic for plane in one]),
            "printed_threshold": _mean([plane.printed_threshold for plane in one]),
        }
        if time_s == TIMES_S[-1]:
            for name, many in errors.items():
                at_most = [float(error <= PRINTED[name]) for error in many]
                values[f"{name}_as_printed_share"] = _mean(at_most)
        for quantity, value in values.items():
            row = _row(case, len(found), time_s, quantity, value) | {"part": "example"}
            if time_s == TIMES_S[-1]:
                row["printed"] = PRINTED.get(quantity)
            rows.append(row)
    return rows


def _rejection(case: Case, found: list[ManoeuvrePlane]) -> list[Row]:
    exact = float(np.mean([not plane.is_planar for plane in found]))
    printed = float(np.mean([bool(plane.refused_by_printed_criterion) for plane in found]))
    row = _row(case, len(found), TIMES_S[-1], "refused_share", exact)
    low, high = share_band(LEVEL, len(found))
    row |= {"expected": LEVEL, "band_low": low, "band_high": high}
    by_printed = _row(case, len(found), TIMES_S[-1], "refused_by_printed_share", printed)
    return [one | {"part": "rejection"} for one in (row, by_printed)]


def _helix(case: Case, found: list[ManoeuvrePlane]) -> list[Row]:
    share = float(np.mean([not plane.is_planar for plane in found]))
    return [_row(case, len(found), TIMES_S[-1], "refused_share", share) | {"part": "helix"}]


def _chosen(rows: list[Row], **wanted: Value) -> list[Row]:
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


def _errors_table(rows: list[Row]) -> Table:
    cells = []
    for radius in RADII_M:
        for time_s in TIMES_S[:: len(TIMES_S) // 2]:
            at = _chosen(rows, part="example", radius_m=radius, time_s=time_s)
            value = {row["quantity"]: row["value"] for row in at}
            printed = {row["quantity"]: row["printed"] for row in at}
            row: list[Value] = [radius, time_s, value["determined_share"]]
            for name in PRINTED:
                share = value.get(f"{name}_as_printed_share")
                row += [value[name], printed[name], None if share is None else 100.0 * float(share)]
            cells.append(tuple(row))
    return Table(
        title="Mean errors of the plane of a circle",
        header=(
            "radius, m", "t, s", "determined", "normal, mrad", "printed", "as good, %",
            "distance, m", "printed", "as good, %",
        ),
        rows=tuple(cells),
        caption="The paper does not tell the radius; it reads its errors from figures of one run. "
        "As good: share of the runs whose error is at most that. Determined: share of the runs in "
        "which a straight line does not explain the points too.",
    )  # fmt: skip


def _rejection_table(rows: list[Row]) -> Table:
    cells = []
    for row in _chosen(rows, part="rejection", quantity="refused_share"):
        (by_printed,) = _chosen(
            rows, part="rejection", source=row["source"], quantity="refused_by_printed_share"
        )
        low, high = (100.0 * float(row[name] or 0.0) for name in ("band_low", "band_high"))
        cells.append(
            (
                row["source"], row["runs"], 100.0 * float(row["value"] or 0.0),
                f"{low:.2f} … {high:.2f}", 100.0 * float(by_printed["value"] or 0.0),
            )
        )  # fmt: skip
    return Table(
        title="How often the plane of a circle is refused, %",
        header=("source", "runs", "χ², N − 3", "99.9 % band of 0.3 %", "criterion (1.17)"),
        rows=tuple(cells),
        caption="At the level of 0.3 % that the paper names.",
    )


def _helix_table(rows: list[Row]) -> Table:
    cells: list[tuple[Value, ...]] = []
    for climb in CLIMBS_MPS:
        at = _chosen(rows, part="helix", climb_mps=climb)
        shares = {row["radius_m"]: 100.0 * float(row["value"] or 0.0) for row in at}
        cells.append((climb, *(shares[radius] for radius in HELIX_RADII_M)))
    turned = (np.degrees(SPEED_MPS / radius * TIMES_S[-1]) for radius in HELIX_RADII_M)
    return Table(
        title="How often a helix is told from a plane, %",
        header=(
            "climb along the axis, m/s",
            *(
                f"radius {radius:g} m: {angle:.0f}°"
                for radius, angle in zip(HELIX_RADII_M, turned, strict=True)
            ),
        ),
        rows=tuple(cells),
        caption=f"After {TIMES_S[-1]:g} s, in which the circle is flown through so many degrees.",
    )


def _notes(rows: list[Row]) -> list[str]:
    shares = _chosen(rows, part="rejection", quantity="refused_by_printed_share")
    printed = float(shares[0]["value"] or 0.0)
    return [
        "Λ has N − 3 degrees of freedom: the plane takes three parameters from the points. The "
        f"printed criterion √(2 Λ) > √(2 N) + 2 refuses {100.0 * printed:.1f} % of plane motions "
        "here, not 0.3 %: by Fisher's approximation it stands at two sigma, which is 2.3 %.",
        "`proportional`: sources whose sigmas are as 1, 2 and 3, of one shape and direction, by "
        "the eigenproblem. `two directions`: covariances turned by 90° against each other, which "
        "are not proportional, by the search that starts from it.",
        "Half a turn of a helix is nearly an inclined plane: a slow climb is not told from it, and "
        "does not matter. The more of a turn is seen, the slower a climb is told.",
    ]
