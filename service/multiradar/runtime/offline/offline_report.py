"""`report.json` of an offline run."""

from dataclasses import asdict
from importlib.metadata import version

from pydantic import JsonValue

from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar.runtime.offline.offline_job import (
    BIAS_CORRELATIONS_FILE,
    BIASES_FILE,
    HEALTH_FILE,
    REJECTS_FILE,
    TRACKS_FILE,
    TRANSITIONS_FILE,
    OfflineJob,
    OfflineResult,
)
from multiradar_schemas.reject import RejectCode
from multiradar_schemas.report import Counts, InputFile, OutputFile, Report

REPORT_FILE = "report.json"


def offline_report(job: OfflineJob, result: OfflineResult) -> Report:
    """Return the report of a run; it does not depend on batches, workers or wall-clock time.

    Parameters
    ----------
    job : OfflineJob
        Input and settings.
    result : OfflineResult
        Counts and results.

    Returns
    -------
    Report
        Counts, settings, digest; figures: whether the recording had to be sorted, number of tracks,
        last biases with sigma, health and alarms of the radars, unobservable combinations of
        biases, accepted measurements by outcome, plots of trajectory bundles by outcome, and
        ASTERIX records written.
    """
    counts = Counts(
        read=result.read,
        accepted=result.accepted,
        rejected=result.rejected_total,
        duplicate=result.duplicate,
    )
    recording = job.recording
    kinds: JsonValue = None if job.kinds is None else [*sorted(job.kinds)]
    biases: dict[str, JsonValue] = {
        sensor: {name: {**value} for name, value in parameters.items()}
        for sensor, parameters in result.final_biases.items()
    }
    windows = [OutputFile(file=file, rows=rows) for file, rows in result.window_rows.items()]
    return Report(
        command="track",
        version=version("multiradar"),
        counts=counts,
        rejected_by_code={RejectCode(code): n for code, n in sorted(result.rejected.items())},
        inputs=[InputFile(file=recording.path.name, bytes=recording.octets, counts=counts)],
        outputs=[
            OutputFile(file=TRACKS_FILE, rows=result.updates),
            OutputFile(file=TRANSITIONS_FILE, rows=result.steps),
            OutputFile(file=BIASES_FILE, rows=result.bias_rows),
            OutputFile(file=BIAS_CORRELATIONS_FILE, rows=result.correlation_rows),
            OutputFile(file=HEALTH_FILE, rows=result.health_rows),
            *windows,
            OutputFile(file=REJECTS_FILE, rows=result.rejected_total + result.duplicate),
        ],
        output_sha256=result.output_sha256,
        settings={
            **asdict(job.settings),
            "hidden_fields": [*job.settings.hidden_fields],
            "kinds": kinds,
            "sensors": list(job.sensors.ids),
        },
        figures={
            "sorted": recording.sorted,
            "tracks": result.tracks,
            "tracks_confirmed": result.tracks_confirmed,
            "measurements_by_outcome": dict(sorted(result.tracker.items())),
            "arrivals": {name: {**record} for name, record in result.arrivals.items()},
            "warnings": [*result.warnings],
            "diagnoses": [{**one.document()} for one in result.diagnoses],
            "duplicates_by_sensor": dict(sorted(result.duplicates_by_sensor.items())),
            "track_transitions": {**result.transitions},
            "final_biases": biases,
            "sensor_health": {name: {**row} for name, row in result.final_health.items()},
            "sensor_alarms": [{**alarm} for alarm in result.alarms],
            "unobservable_biases": [
                _unobservable_figures(one, job.sensors) for one in result.unobservable_biases
            ],
            **({"trajectories": {**result.trajectories}} if result.trajectories else {}),
            **({"aircraft_delays": {**result.delays}} if result.delays else {}),
            **({"reference": {**result.reference}} if result.reference else {}),
            **({"asterix_records": {**result.asterix}} if result.asterix else {}),
        },
    )


def _unobservable_figures(
    combination: UnobservableBias, sensors: SensorTable
) -> dict[str, JsonValue]:
    weights: list[JsonValue] = [
        {
            "sensor_id": sensors.ids[sensor],
            "parameter": PARAMETER_NAMES[kind],
            "weight": weight,
        }
        for sensor, kind, weight in zip(
            sensors.parameter_sensor, sensors.parameter_kind, combination.weights, strict=True
        )
        if weight != 0.0
    ]
    return {
        "what": combination.name,
        "prior_ratio": combination.prior_ratio,
        "reason": combination.reason,
        "weights": weights,
    }
