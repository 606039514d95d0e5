"""The example of Korobochkin: the plane of a circle, tests of planarity, and helices.

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
    PUBLISHED,
    RADII_M,
    SOURCES,
    SPEED_MPS,
    TIMES_S,
    Case,
    fraction_band,
    normal_error_rad,
    planes,
)
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult, step_counter
from multiradar.restoration.geometry.manoeuvre_plane import LEVEL, ManoeuvrePlane

Row = dict[str, Value]

#: Factor of the runs for counting rejections: at 0.3 % a hundred runs are too few.
REJECTION_FACTOR = 30
SUMMARY = (
    "An aircraft flies a circle in a vertical plane; its position is measured at 100 Hz with "
    "errors of 25 m on each axis. How accurate is the fitted plane, how often is planar motion "
    "rejected, and can a helix be distinguished from a circle?"
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Fit planes to circles and helices.

    Parameters
    ----------
    options : StudyOptions
        `runs` of each case, and the seed.
    progress : callable
        Called with the number of completed cases.

    Returns
    -------
    StudyResult
        Rows as in docs/validation/studies.md.

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
    # Each case has its own random stream.
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


# The planes at one of the times, of the runs with a determined plane.
def _determined(found: list[list[ManoeuvrePlane | None]], index: int) -> list[ManoeuvrePlane]:
    return [plane for run in found if (plane := run[index]) is not None]


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
    for index, time_s in enumerate(TIMES_S):
        one = _determined(found, index)
        # The plane of the circle passes through the origin.
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
                at_most = [float(error <= PUBLISHED[name]) for error in many]
                values[f"{name}_as_printed_share"] = _mean(at_most)
        for quantity, value in values.items():
            row = _row(case, len(found), time_s, quantity, value) | {"part": "example"}
            if time_s == TIMES_S[-1]:
                row["printed"] = PUBLISHED.get(quantity)
            rows.append(row)
    return rows


def _rejection(case: Case, found: list[ManoeuvrePlane]) -> list[Row]:
    exact = float(np.mean([not plane.is_planar for plane in found]))
    published = float(np.mean([bool(plane.refused_by_printed_criterion) for plane in found]))
    row = _row(case, len(found), TIMES_S[-1], "refused_share", exact)
    low, high = fraction_band(LEVEL, len(found))
    row |= {"expected": LEVEL, "band_low": low, "band_high": high}
    by_published = _row(case, len(found), TIMES_S[-1], "refused_by_printed_share", published)
    return [one | {"part": "rejection"} for one in (row, by_published)]


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
            published = {row["quantity"]: row["printed"] for row in at}
            row: list[Value] = [radius, time_s, value["determined_share"]]
            for name in PUBLISHED:
                share = value.get(f"{name}_as_printed_share")
                percent = None if share is None else 100.0 * float(share)
                row += [value[name], published[name], percent]
            cells.append(tuple(row))
    return Table(
        title="Mean errors of the plane fitted to a circle",
        header=(
            "radius, m", "t, s", "determined", "normal, mrad", "published",
            "runs at or below, %", "distance, m", "published", "runs at or below, %",
        ),
        rows=tuple(cells),
        caption="The paper does not give the radius; the published errors are taken from figures "
        "of a single run. Runs at or below: fraction of runs with an error no larger than the "
        "published error. Determined: fraction of runs in which the points do not fit a straight "
        "line.",
    )  # fmt: skip


def _rejection_table(rows: list[Row]) -> Table:
    cells = []
    for row in _chosen(rows, part="rejection", quantity="refused_share"):
        (by_published,) = _chosen(
            rows, part="rejection", source=row["source"], quantity="refused_by_printed_share"
        )
        low, high = (100.0 * float(row[name] or 0.0) for name in ("band_low", "band_high"))
        cells.append(
            (
                row["source"], row["runs"], 100.0 * float(row["value"] or 0.0),
                f"{low:.2f} … {high:.2f}", 100.0 * float(by_published["value"] or 0.0),
            )
        )  # fmt: skip
    return Table(
        title="Rejection rate of planar motion on a circle, %",
        header=("source", "runs", "χ², N − 3", "99.9 % band around 0.3 %", "criterion (1.17)"),
        rows=tuple(cells),
        caption="At the published significance level of 0.3 %.",
    )


def _helix_table(rows: list[Row]) -> Table:
    cells: list[tuple[Value, ...]] = []
    for climb in CLIMBS_MPS:
        at = _chosen(rows, part="helix", climb_mps=climb)
        shares = {row["radius_m"]: 100.0 * float(row["value"] or 0.0) for row in at}
        cells.append((climb, *(shares[radius] for radius in HELIX_RADII_M)))
    turned = (np.degrees(SPEED_MPS / radius * TIMES_S[-1]) for radius in HELIX_RADII_M)
    return Table(
        title="Helix detection rate, %",
        header=(
            "speed along the helix axis, m/s",
            *(
                f"radius {radius:g} m: {angle:.0f}°"
                for radius, angle in zip(HELIX_RADII_M, turned, strict=True)
            ),
        ),
        rows=tuple(cells),
        caption=f"After {TIMES_S[-1]:g} s. The column headings give the angle flown around the "
        "circle.",
    )


def _notes(rows: list[Row]) -> list[str]:
    shares = _chosen(rows, part="rejection", quantity="refused_by_printed_share")
    published = float(shares[0]["value"] or 0.0)
    return [
        "Λ has N − 3 degrees of freedom, because the plane has three parameters. The published "
        f"criterion √(2 Λ) > √(2 N) + 2 rejects {100.0 * published:.1f} % of planar motions here, "
        "not 0.3 %: in Fisher's approximation, its threshold corresponds to two sigma, that is, "
        "2.3 %.",
        "`proportional`: sources with sigmas in the ratio 1 : 2 : 3 and covariances of the same "
        "shape and orientation; the plane is found by solving an eigenproblem. `two directions`: "
        "covariances rotated by 90° relative to each other, which are not proportional; the plane "
        "is found by a search that starts from the solution of the eigenproblem.",
        "Half a turn of a helix lies almost in an inclined plane: a slow climb is not detected, "
        "but has no practical effect either. The larger the observed part of a turn, the slower "
        "the climb that can be detected.",
    ]
