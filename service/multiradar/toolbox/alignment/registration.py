"""The steps of a registration: tracks, pairs of plots, biases, withheld aircraft, trends."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from multiradar.diagnosis.alignment.cross_validation import CrossValidation, cross_validate
from multiradar.diagnosis.alignment.fit import Alignment, Problem, fit
from multiradar.diagnosis.alignment.tracked_plots import PlotCollector
from multiradar.diagnosis.alignment.trends import Trend, trend
from multiradar.errors import DataWarning, InputError
from multiradar.toolbox.messages.warning import warn
from multiradar_converters.leftovers import temporary_folder

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.offline.offline_job import OfflineResult
    from multiradar.storage.recording import Recording
    from multiradar.tracking.settings import TrackingSettings


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """Everything that a report of a registration contains.

    Attributes
    ----------
    sensors : SensorTable
        The sensors.
    tracked : OfflineResult
        The run that associated the plots.
    track_fraction : float
        Fraction of the tracks whose plots were used.
    problem : Problem
        The pairs.
    whole : Alignment
        Fit of all pairs.
    validation : CrossValidation
        Residuals of withheld aircraft.
    trend : Trend
        Biases by time.
    """

    sensors: "SensorTable"
    tracked: "OfflineResult"
    track_fraction: float
    problem: Problem
    whole: Alignment
    validation: CrossValidation
    trend: Trend


def register(
    recording: "Recording",
    sensors: "SensorTable",
    settings: "TrackingSettings",
    *,
    kinds: Collection[str] | None,
    folds: int,
    workers: int,
    on_progress: Callable[[int], None] = lambda _rows: None,
) -> Registration:
    """Register the radars of a recording.

    Parameters
    ----------
    recording : Recording
        The measurements.
    sensors : SensorTable
        The sensors, with the priors of their biases.
    settings : TrackingSettings
        Settings of the tracker, which associates the plots.
    kinds : collection of str, optional
        Kinds of measurement to use; all by default.
    folds : int
        Folds over aircraft.
    workers : int
        Threads of the tracker.
    on_progress : callable
        Called with the number of measurements that were tracked.

    Raises
    ------
    InputError
        No aircraft was seen by two sensors at nearly the same time.
    """
    from multiradar.runtime.offline.offline_job import OfflineJob
    from multiradar.runtime.offline.offline_run import track_recording

    collector = PlotCollector()
    job = OfflineJob(recording, sensors, settings, kinds, workers)
    with temporary_folder("multiradar-align-") as folder:
        tracks = Path(folder) / "tracks"
        tracks.mkdir()
        tracked = track_recording(job, tracks, on_progress, collector.add)
    if not len(collector):
        _warn_of(tracked)
        raise InputError(_without_tracks(tracked))
    problem = Problem.of_plots(collector.plots(settings.acceleration_density), sensors)
    if not problem.pairs.size:
        _warn_of(tracked)
        msg = (
            "no aircraft has plots from two sensors within 2 s; use a recording in which several "
            "radars, or a radar and ADS-B or multilateration, detect the same aircraft, and check "
            "the sites in the sensors file"
        )
        raise InputError(msg)
    whole = fit(problem, np.ones(problem.pairs.size, np.bool_))
    return Registration(
        sensors=sensors,
        tracked=tracked,
        track_fraction=collector.fraction,
        problem=problem,
        whole=whole,
        validation=cross_validate(problem, whole, folds),
        trend=trend(problem, whole),
    )


def _warn_of(tracked: "OfflineResult") -> None:
    for one in tracked.diagnoses:
        warn(one.sentence, DataWarning)


def _without_tracks(tracked: "OfflineResult") -> str:
    codes = ", ".join(f"{count} {code}" for code, count in tracked.rejected.most_common(3))
    return (
        f"no tracks: {tracked.accepted} of {tracked.read} measurements were accepted"
        + (f", rejected: {codes}" if codes else "")
        + "; check the sensor ids and sites in the sensors file"
    )
