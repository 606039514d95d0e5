"""Tables and notes about all days, for the terminal."""

from pathlib import Path
from typing import Any

import polars as pl

from multiradar.diagnosis.alignment.trends import SIGMAS
from multiradar.report.cells import estimate_texts
from multiradar.report.content import Document, Table
from multiradar.toolbox.output import Output
from multiradar.toolbox.tracking.reprocessing.periods import MERGED_FILE, STEPS_FILE


class Days(Output):
    """The output of `reprocess`: tables of biases, report."""

    _wanted = "the output of `reprocess`"


def summary_of(out: Path) -> Document:
    """Return what the output of all days contains.

    Parameters
    ----------
    out : Path
        The output directory.
    """
    found = Days(out)
    days = found.report["figures"]["days"]
    counts = found.report["counts"]
    merged, steps = (found.table(Path(file).stem) for file in (MERGED_FILE, STEPS_FILE))
    flagged = steps.filter(pl.col("chi2") > SIGMAS**2)
    statuses = ", ".join(
        f"{number} {status}"
        for status in ("made", "kept", "failed")
        if (number := sum(day["status"] == status for day in days))
    )
    tables = [_merged(merged), _steps(flagged, len(steps))]
    return Document(
        title=f"Days of {out}",
        summary=f"{len(days)} days: {statuses}; read {counts['read']:,} measurements: accepted "
        f"{counts['accepted']:,}, rejected {counts['rejected']:,}, duplicate "
        f"{counts['duplicate']:,}",
        command="",
        tables=[table for table in tables if table.rows],
        plots=(),
        notes=[_note(one) for one in found.report["figures"]["tests"] if not one["sensor_id"]],
    )


def _merged(merged: pl.DataFrame) -> Table:
    rows = []
    for row in merged.iter_rows(named=True):
        estimate, sigma = estimate_texts(row["estimate"], row["sigma"])
        slope: tuple[str | None, str | None] = (None, None)
        if row["drift_per_day"] is not None:
            slope = estimate_texts(row["drift_per_day"], row["drift_sigma_per_day"])
        rows.append(
            (
                *_named(row), str(row["days"]), estimate, sigma,
                row["chi2"], str(row["degrees_of_freedom"]), _probability(row["p_value"]),
                *slope, _probability(row["drift_p_value"]),
            )
        )  # fmt: skip
    return Table(
        title="Biases of all days (measured − true)",
        header=(
            "sensor", "parameter", "days", "estimate", "sigma", "χ²", "d.o.f.", "p",
            "drift / d", "sigma / d", "p (drift)",
        ),
        rows=tuple(rows),
        caption="χ²: scatter of the daily estimates about a constant; p: probability of a larger "
        "χ² if the bias is the same on all days; p (drift): probability of a steeper slope if the "
        "bias does not drift.",
    )  # fmt: skip


def _steps(flagged: pl.DataFrame, tested: int) -> Table:
    rows = tuple(
        (
            *_named(row), row["day_before"], row["day"],
            *estimate_texts(row["difference"], row["sigma"]), row["chi2"],
            _probability(row["p_value"]),
        )
        for row in flagged.iter_rows(named=True)
    )  # fmt: skip
    return Table(
        title=f"Steps between days above {SIGMAS:g} sigma",
        header=(
            "sensor", "parameter", "from", "to", "difference", "sigma", "χ²", "p",
        ),
        rows=rows,
        caption=f"{len(flagged)} of {tested} differences; expected by chance: 1 in 16,000.",
    )  # fmt: skip


# Three digits after the point would show small ones as zero.
def _probability(p_value: float | None) -> str | None:
    return None if p_value is None else f"{p_value:.2g}"


def _named(row: dict[str, Any]) -> tuple[str, str]:
    region = f"{row['region']}: " if row["region"] else ""
    return f"{region}{row['sensor_id']}", row["parameter"]


def _note(test: dict[str, Any]) -> str:
    where = f"{test['region']}: all" if test["region"] else "All"
    return (
        f"{where} biases jointly, including correlations, under the hypothesis that they are the "
        f"same on all {test['days']} days: χ² {test['chi2']:.1f} with "
        f"{test['degrees_of_freedom']} degrees of freedom (p {test['p_value']:.2g})."
    )
