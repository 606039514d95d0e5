"""An offline run: input, settings, files and results."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

from pydantic import JsonValue

from multiradar.diagnosis.model import Diagnosis
from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.step_pool import OpenStepPool
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.storage.recording import Recording
from multiradar.tracking.settings import TrackingSettings

BATCH_ROWS = 8192
TRACKS_FILE = "tracks.parquet"
BIASES_FILE = "biases.parquet"
BIAS_CORRELATIONS_FILE = "bias_correlations.parquet"
TRANSITIONS_FILE = "transitions.parquet"
HEALTH_FILE = "health.parquet"
PLANES_FILE = "manoeuvre_planes.parquet"
OBSERVABILITY_FILE = "observability.parquet"
ENCOUNTERS_FILE = "encounters.parquet"
DELAYS_FILE = "aircraft_delays.parquet"
TRAJECTORIES_FILE = "trajectories.parquet"
FORECASTS_FILE = "forecasts.parquet"
BUNDLE_FORECASTS_FILE = "bundle_forecasts.parquet"
REJECTS_FILE = "rejects.ndjson"


@dataclass(frozen=True, slots=True)
class OfflineJob:
    """Input and settings of an offline run.

    Attributes
    ----------
    recording : Recording
        The measurements.
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        Settings of the tracker.
    kinds : collection of str, optional
        Kinds of measurement to use; all by default.
    workers : int
        Threads of the tracker.
    batch_rows : int
        Measurements in one call of the engine.
    plane_window_s, observability_window_s : float, optional
        Windows of the manoeuvre planes and of the observability of tracks, s; not written by
        default.
    encounters : EncounterQuery, optional
        Encounters to write; none by default.
    trajectories : TrajectoryOptions, optional
        Settings of trajectory bundles; none by default.
    forecasts_every_s : float, optional
        Data time between two forecasts of a track, s; not written by default.
    open_steps : callable, optional
        Opens what updates the tracks in place of threads.
    start : BiasState, optional
        Biases to start from, in place of the priors of the sensors.
    """

    recording: Recording
    sensors: SensorTable
    settings: TrackingSettings
    kinds: Collection[str] | None = None
    workers: int = 1
    batch_rows: int = BATCH_ROWS
    plane_window_s: float | None = None
    observability_window_s: float | None = None
    encounters: EncounterQuery | None = None
    trajectories: TrajectoryOptions | None = None
    forecasts_every_s: float | None = None
    open_steps: OpenStepPool | None = None
    start: BiasState | None = None


@dataclass(slots=True)
class OfflineResult:
    """Counts and results of a run.

    Attributes
    ----------
    read, accepted, duplicate : int
        Measurements of the selected kinds; those processed by the tracker; duplicates.
    duplicates_by_sensor : Counter
        Duplicates by sensor, where there are any.
    rejected : Counter
        Rejected measurements by code.
    updates, tracks, tracks_confirmed, bias_rows, correlation_rows, health_rows, steps : int
        Rows of `tracks.parquet`, tracks initiated and confirmed, rows of `biases.parquet`, of
        `bias_correlations.parquet`, of `health.parquet` and of `transitions.parquet`.
    window_rows : dict
        Rows of the requested tables by epoch, by file.
    final_biases : dict
        Last estimate of each sensor and parameter, its sigma, and sigma over prior sigma.
    final_health : dict
        Last row of `health.parquet` of each radar.
    alarms : list of dict
        Alarms of radars: `time_s`, `sensor_id` and the `alarm` raised.
    unobservable_biases : tuple of UnobservableBias
        Combinations of biases that are not observable from the measurements.
    tracker : dict
        Accepted measurements by outcome in the filter.
    transitions : dict
        Number of lifecycle transitions of tracks, by name.
    arrivals : dict
        By sensor: measurements received, late measurements, delay behind the data time.
    warnings : list of str
        Warnings for the user.
    output_sha256 : str
        Digest of all updates and biases.
    trajectories : dict
        Plots of trajectory bundles by outcome; empty without bundles.
    asterix : dict
        ASTERIX records written, by category, and omitted items.
    diagnoses : list of Diagnosis
        Findings about sensors, their settings or the recording.
    reference : dict
        Updates of a bias reference by use; empty without one.
    delays : dict
        Tracks with a delay of their transponder, and its scatter; empty where none is estimated.
    """

    read: int = 0
    accepted: int = 0
    duplicate: int = 0
    duplicates_by_sensor: Counter[str] = field(default_factory=Counter)
    rejected: Counter[str] = field(default_factory=Counter)
    updates: int = 0
    tracks: int = 0
    tracks_confirmed: int = 0
    bias_rows: int = 0
    correlation_rows: int = 0
    health_rows: int = 0
    steps: int = 0
    window_rows: dict[str, int] = field(default_factory=dict)
    final_biases: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    final_health: dict[str, dict[str, Any]] = field(default_factory=dict)
    alarms: list[dict[str, Any]] = field(default_factory=list)
    unobservable_biases: tuple[UnobservableBias, ...] = ()
    tracker: dict[str, int] = field(default_factory=dict)
    transitions: dict[str, int] = field(default_factory=dict)
    arrivals: dict[str, dict[str, Any]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    output_sha256: str = ""
    trajectories: dict[str, Any] = field(default_factory=dict)
    asterix: dict[str, int] = field(default_factory=dict)
    reference: dict[str, JsonValue] = field(default_factory=dict)
    delays: dict[str, Any] = field(default_factory=dict)
    diagnoses: list[Diagnosis] = field(default_factory=list)

    @property
    def rejected_total(self) -> int:
        """Number of rejected measurements."""
        return sum(self.rejected.values())
