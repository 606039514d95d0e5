"""All measures of one evaluation."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from multiradar.evaluation.instants import Instants, assign_tracks
from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.measures.consistency import Consistency, consistency
from multiradar.evaluation.measures.continuity import (
    aircraft_updates,
    intervals,
    tracked_periods,
    tracked_since,
)
from multiradar.evaluation.measures.distances import SetDistances, set_distances
from multiradar.evaluation.measures.forecast_errors import ForecastErrors, forecast_errors, joined
from multiradar.evaluation.measures.identity import Identity, identity_over_time
from multiradar.evaluation.measures.plots_on_tracks import first_plots, plots_on_the_right_track
from multiradar.evaluation.measures.siap import Siap, siap
from multiradar.evaluation.measures.track_classes import TrackClasses, classify_tracks
from multiradar.evaluation.measures.update_errors import (
    UpdateErrors,
    aircraft_of_updates,
    errors_of_updates,
)
from multiradar.evaluation.measures.update_times import with_update_times
from multiradar.evaluation.presets import Evidence, PresetResult, evaluate_presets
from multiradar.evaluation.sensor_differences import SensorDifference, sensor_differences
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Floats, Indices, Reference, Tracks
from multiradar_schemas.sensors.sensor import Sensor


@dataclass(frozen=True, slots=True, eq=False)
class Scorecard:
    """Results of an evaluation.

    Attributes
    ----------
    settings : EvaluationSettings
        Settings of the comparison.
    tracks, reference : Tracks, Reference
        Tracks and reference.
    instants : Instants
        Assignment at each instant.
    identity : Identity
        Assignment over time.
    aircraft : (n,) int64
        Aircraft of each update; −1 for none.
    errors : UpdateErrors
        Errors of updates.
    track_classes : TrackClasses
        Class of each track.
    siap : Siap
        Measures of the picture.
    distances : SetDistances
        OSPA and GOSPA.
    position, velocity : Consistency, optional
        NEES.
    delay_s : (m,) float64
        Initiation delay of each aircraft: infinite for one never tracked.
    interval_s : (i,) float64
        Times between updates.
    interval_aircraft : (i,) int64
        Aircraft of each interval.
    preset_results : list of PresetResult
        Presets.
    plots : tuple of int, optional
        Plots on the right track, and all plots.
    biases : list of BiasHistory
        Biases over time.
    forecasts : ForecastErrors, optional
        Forecasts with known truth.
    differences : list of SensorDifference
        Range and azimuth of radars against the reference.
    """

    settings: EvaluationSettings
    tracks: Tracks
    reference: Reference
    instants: Instants
    identity: Identity
    aircraft: Indices
    errors: UpdateErrors
    track_classes: TrackClasses
    siap: Siap
    distances: SetDistances
    position: Consistency | None
    velocity: Consistency | None
    delay_s: Floats
    interval_s: Floats
    interval_aircraft: Indices
    preset_results: list[PresetResult]
    plots: tuple[int, int] | None = None
    biases: list[BiasHistory] = field(default_factory=list)
    forecasts: ForecastErrors | None = None
    differences: list[SensorDifference] = field(default_factory=list)


def evaluate(
    tracks: Tracks,
    reference: Reference,
    settings: EvaluationSettings,
    presets: Sequence[str] = (),
    *,
    plots: pl.DataFrame | None = None,
    biases: Sequence[BiasHistory] = (),
    forecasts: Sequence[tuple[pl.DataFrame, str]] = (),
    sensors: Sequence[Sensor] = (),
    radar_plots: pl.DataFrame | None = None,
) -> Scorecard:
    """Compare tracks with a reference.

    Parameters
    ----------
    tracks : Tracks
        The tracks to evaluate.
    reference : Reference
        On the same plane.
    settings : EvaluationSettings
        Settings of the comparison.
    presets : sequence of str
        Presets to evaluate.
    plots : DataFrame, optional
        `time_s`, `sensor_id` and `name` (of the aircraft, null where unknown) of the tracked plots.
    biases : sequence of BiasHistory
        Biases to include.
    forecasts : sequence of (DataFrame, str)
        `forecasts.parquet` and `bundle_forecasts.parquet`, with their names used in errors.
    sensors : sequence of Sensor
        Sensors of the tracks.
    radar_plots : DataFrame, optional
        Plots of their radars, see `sensor_differences`.

    Returns
    -------
    Scorecard
        All measures.

    Raises
    ------
    InputError
        Tracks and reference do not overlap in time, or forecasts cannot be used.
    UnknownPresetError
        Unknown preset.
    """
    instants = assign_tracks(tracks, reference, settings)
    identity = identity_over_time(instants, len(reference.names), len(tracks.ids), settings.dwell_s)
    aircraft = aircraft_of_updates(tracks, reference, instants, identity)
    errors = errors_of_updates(tracks, reference, aircraft, settings)
    updates = aircraft_updates(tracks, reference, aircraft)
    where = tracked_periods(reference, updates)
    interval_s, interval_aircraft = intervals(updates, where)
    reported = np.hypot(tracks.position_sigma_m[errors.update], settings.reference_sigma_m)
    reported_velocity = tracks.velocity_sigma_mps[errors.update]
    # Aircraft without plots are expected from their first reference position on.
    expected = reference.time_s[
        np.searchsorted(reference.aircraft, np.arange(len(reference.names)))
    ].copy()
    on_track = None
    if plots is not None:
        plots = with_update_times(plots, sensors)
        first = first_plots(reference, plots)
        expected[list(first)] = list(first.values())
        on_track = plots_on_the_right_track(tracks, reference, aircraft, plots, sensors)
    delay_s = np.maximum(tracked_since(tracks, instants, identity) - expected, 0.0)
    return Scorecard(
        settings=settings,
        tracks=tracks,
        reference=reference,
        instants=instants,
        identity=identity,
        aircraft=aircraft,
        errors=errors,
        track_classes=classify_tracks(tracks, instants),
        siap=siap(instants, identity),
        distances=set_distances(instants, settings.cutoff_m, settings.order),
        position=consistency(errors.position_m, reported, errors.aircraft, errors.time_s),
        velocity=consistency(
            errors.velocity_mps, reported_velocity, errors.aircraft, errors.time_s
        ),
        delay_s=delay_s,
        interval_s=interval_s,
        interval_aircraft=interval_aircraft,
        preset_results=evaluate_presets(presets, Evidence(errors, updates, where, interval_s)),
        plots=on_track,
        biases=list(biases),
        forecasts=joined(
            [forecast_errors(*table, tracks, reference, aircraft) for table in forecasts]
        ),
        differences=(
            []
            if radar_plots is None
            else sensor_differences(
                tracks, reference, aircraft, radar_plots, sensors=sensors, biases=biases
            )
        ),
    )
