"""Tables of the study of section 1.6."""

from collections.abc import Sequence

import numpy as np

from multiradar.report.content import Table, Value
from multiradar.research.studies.bias_estimation.cases import Case, Findings
from multiradar.research.studies.bias_estimation.loss import Loss

HEADINGS = ("position, m", "velocity, m/s", "azimuth bias, °", "range bias, m")


def all_tables(findings: Findings, losses: Sequence[Loss], runs: int) -> list[Table]:
    """Return the tables: final errors, their reported values, consistency, and drift.

    Parameters
    ----------
    findings : Findings
        Results of the study.
    losses : sequence of Loss
        Loss of the two-stage filter by drift.
    runs : int
        Number of runs.

    Returns
    -------
    list of Table
        The first is the main one.
    """
    end_s = findings.cases[0].times_s[-1]
    tables = [
        Table(
            f"Mean errors after {end_s:g} s",
            ("filter", "measurement", "drift", *HEADINGS),
            tuple((*_which(case), *case.mean[-1].tolist()) for case in findings.cases),
            f"Magnitude of the error, averaged over {runs} runs and all aircraft or radars.",
        ),
        Table(
            f"Errors after {end_s:g} s: true errors from (1.26), and errors reported by the "
            "filters",
            (
                "filter", "measurement", "drift",
                *(f"{heading}, {kind}" for heading in HEADINGS for kind in ("true", "reported")),
            ),
            tuple(
                (*_which(case), *np.stack([case.theoretical[-1], case.reported[-1]], 1).ravel())
                for case in findings.cases
            ),
            "Square roots of the averaged trace of the position or velocity block (1.27). These "
            "are RMS values, which for Gaussian errors are up to 1.13 times the mean magnitude in "
            "two dimensions and 1.25 times in one dimension.",
        ),
        _consistency_table(findings, runs),
    ]  # fmt: skip
    if losses:
        tables.append(_loss_table(losses))
    return tables


def _which(case: Case) -> tuple[Value, ...]:
    return case.name, case.form, case.drift


def _consistency_table(findings: Findings, runs: int) -> Table:
    rows: list[tuple[Value, ...]] = []
    for case in findings.cases:
        bands = findings.bands[case.drift]
        inside = np.mean((case.nees >= bands.low) & (case.nees <= bands.high), axis=0)
        always = np.all((case.nees >= bands.all_low) & (case.nees <= bands.all_high), axis=0)
        cells: list[Value] = []
        for column in range(2):
            cells += [
                float(case.nees[-1, column]),
                float(case.nees[:, column].mean()),
                f"{100.0 * inside[column]:.0f} %",
                bool(always[column]),
            ]
        rows.append((*_which(case), *cells))
    parts = ("final", "mean over time", "time within band", "always within wider band")
    return Table(
        "Normalised estimation error squared (NEES) per dimension; 1 for a consistent filter",
        (
            "filter", "measurement", "drift",
            *(f"{what}, {part}" for what in ("aircraft", "biases") for part in parts),
        ),
        tuple(rows),
        f"For a consistent filter, the mean over {runs} runs is within the 95 % band for 95 % of "
        "the time, and within the wider band at all times with a probability of 95 %.",
    )  # fmt: skip


def _loss_table(losses: Sequence[Loss]) -> Table:
    return Table(
        f"Two-stage and joint filters with drifting biases after {losses[0].time_s:g} s, from "
        "(1.26)",
        (
            "acceleration density, m²/s³", "joint, m", "two-stage, m", "excess over joint, %",
            "aircraft, expected NEES", "biases, expected NEES",
        ),
        tuple(
            (
                loss.density, loss.joint_m, loss.two_stage_m,
                100.0 * (loss.two_stage_m / loss.joint_m - 1.0),
                loss.nees_aircraft, loss.nees_bias,
            )
            for loss in losses
        ),
        "RMS position error with the drift given in the table of section 1.6. The effect of past "
        "biases is common to all aircraft, but the two-stage filter treats this effect as "
        "independent from one aircraft to another. This is harmless if process noise makes the "
        "filter discard the past, but not in exactly straight flight.",
    )  # fmt: skip
