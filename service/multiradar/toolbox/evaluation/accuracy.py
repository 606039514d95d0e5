"""Distances between tracks and ADS-B positions."""

from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar.evaluation.scorecard import evaluate
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.tables import aircraft_name, reference_of_reports, tracks_of

#: The first minute of a track, when it still settles, is excluded.
SETTLING_S = 60.0


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Horizontal distances between tracks and reported positions, m."""

    compared: int
    median_m: float
    rms_m: float


def position_accuracy(reports: pl.DataFrame, updates: pl.DataFrame) -> Accuracy | None:
    """Compare tracks with ADS-B positions, as `multiradar evaluate` does.

    Parameters
    ----------
    reports : DataFrame
        ADS-B rows of `measurements.parquet`.
    updates : DataFrame
        Rows of `tracks.parquet`.

    Returns
    -------
    Accuracy or None
        For updates of settled tracks between reports; None when there are no reports of identified
        aircraft, no confirmed tracks, or none at the time of a report.

    Raises
    ------
    InputError
        A table lacks a column, contains invalid numbers, or covers another time.
    """
    # A dump without ADS-B, or whose plots identify no aircraft.
    if reports.is_empty() or updates.is_empty():
        return None
    if reports.select(aircraft_name()).drop_nulls().is_empty():
        return None
    if updates.filter(pl.col("state") != "tentative").is_empty():
        return None
    settings = EvaluationSettings(settling_s=SETTLING_S)
    reference = reference_of_reports(reports, "ADS-B reports", settings.reference_gap_s)
    tracks = tracks_of(updates, "tracks", reference.plane, tentative=False)
    errors_m = evaluate(tracks, reference, settings).errors.position_m
    if not len(errors_m):
        return None
    return Accuracy(
        compared=len(errors_m),
        median_m=float(np.median(errors_m)),
        rms_m=float(np.sqrt(np.mean(errors_m**2))),
    )
