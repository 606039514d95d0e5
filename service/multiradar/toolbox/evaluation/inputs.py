"""Inputs of an evaluation: tracks, biases, reference and plots."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from multiradar import wire
from multiradar.errors import DataWarning, InputError, MissingColumnError
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.system_tracks import named_by_flight, of_one_processor
from multiradar.evaluation.tables import (
    aircraft_name,
    reference_of_reports,
    reference_of_truth,
    with_rows,
)
from multiradar.toolbox.diagnoses import NOT_SEEN, SYSTEM_TRACKS_FILE, unseen_states
from multiradar.toolbox.evaluation.known import Known
from multiradar.toolbox.evaluation.recorded import (
    dump_tracks,
    has_dump_tracks,
    recorded_truth,
    reports_of_dump,
    true_biases,
)
from multiradar.toolbox.evaluation.tracked import bias_tables, named_by_tracks, read_table
from multiradar.toolbox.inputs import read_sensors
from multiradar.toolbox.messages.warning import warn
from multiradar_schemas.documents.contents import TRACKS, content, no_such

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.evaluation.coverage import CoveredRegion

TRUTH_FILE = "truth.parquet"
TRUE_BIASES_FILE = "truth_biases.parquet"

_SYSTEM_TRACKS = "system tracks (of `convert asterix` or `convert vid`)"
_NO_PLOTS = {"time_s": pl.Float64, "sensor_id": pl.String, "name": pl.String}


def read_truth(
    given: Path, settings: EvaluationSettings, regions: "Sequence[CoveredRegion]" = ()
) -> Known:
    """Read the truth of a simulation.

    Parameters
    ----------
    given : Path
        The folder that `simulate` made, or its `truth.parquet`.
    settings : EvaluationSettings
        Of which the gap of the reference is used.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.

    Returns
    -------
    Known
        With true biases if they are next to it.

    Raises
    ------
    InputError
        It does not exist or cannot be used.
    """
    path = given / TRUTH_FILE if given.is_dir() else given
    frame = read_table(path, "the output of `simulate`")
    reference = reference_of_truth(frame, str(path), settings.reference_gap_s, regions)
    plots = pl.DataFrame(schema=_NO_PLOTS)
    if "sensor_id" in frame.columns:
        name = pl.col("track_number").cast(pl.String).alias("name")
        plots = frame.select(
            pl.col("time_s").cast(pl.Float64), pl.col("sensor_id").cast(pl.String), name
        )
    beside = path.parent / TRUE_BIASES_FILE
    biases = (read_table(beside, "true biases"), str(beside)) if beside.exists() else None
    return Known("truth", given, reference, plots, biases)


def read_recorded(
    given: Path,
    known: Known | None,
    settings: EvaluationSettings,
    regions: "Sequence[CoveredRegion]" = (),
) -> Known:
    """Read the `truth.json` of a dump: the true biases of its radars.

    Parameters
    ----------
    given : Path
        The file, or the folder of the dump.
    known : Known, optional
        Positions of the aircraft; without it the ADS-B reports of the dump are the reference.
    settings : EvaluationSettings
        Of which the gap of the reference is used.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.

    Returns
    -------
    Known
        With true biases.

    Raises
    ------
    InputError
        It is missing or cannot be used, or there are no positions of aircraft.
    """
    truth, path = recorded_truth(given)
    biases = (true_biases(truth), str(path))
    if known is not None:
        claimed = known.claimed | {"truth": str(given)}
        return dataclasses.replace(known, true_biases=biases, claimed=claimed)
    reports = _reports("recorded", given, *reports_of_dump(path, truth), settings, regions=regions)
    return dataclasses.replace(reports, true_biases=biases)


def read_reports(
    given: Path, settings: EvaluationSettings, regions: "Sequence[CoveredRegion]" = ()
) -> Known:
    """Read the ADS-B reports of a recording.

    Parameters
    ----------
    given : Path
        The folder that `convert` or `simulate` made, or its `measurements.parquet`.
    settings : EvaluationSettings
        Of which the gap of the reference is used.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.

    Returns
    -------
    Known
        The other measurements are the plots.

    Raises
    ------
    InputError
        It does not exist, cannot be used, or has no ADS-B reports.
    """
    return _reports("adsb", given, *_measurements(given), settings, regions=regions)


def _reports(
    kind: str,
    given: Path,
    frame: pl.DataFrame,
    source: str,
    settings: EvaluationSettings,
    *,
    regions: "Sequence[CoveredRegion]",
) -> Known:
    reports = frame.filter(pl.col("kind") == "adsb")
    if reports.is_empty():
        msg = f"{source}: no ADS-B reports, which --adsb requires as the reference"
        raise InputError(msg)
    reference = reference_of_reports(reports, source, settings.reference_gap_s, regions)
    others = frame.filter(pl.col("kind") != "adsb")
    return Known(
        kind,
        given,
        reference,
        others.select("time_s", "sensor_id", aircraft_name()),
        reporters=tuple(reports["sensor_id"].unique().sort().to_list()),
    )


def read_system_tracks(
    given: Path,
    settings: EvaluationSettings,
    regions: "Sequence[CoveredRegion]" = (),
    processor: str | None = None,
) -> Known:
    """Read the system tracks of a recording.

    Parameters
    ----------
    given : Path
        The folder that `convert asterix` made, or its `system_tracks.parquet`; or the folder that
        `convert vid` made, that of one aircraft in it, or a `240_mr.new4`.
    settings : EvaluationSettings
        Of which the gap of the reference is used.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.
    processor : str, optional
        `sensor_id` of the processor; needed if there are several.

    Returns
    -------
    Known
        Aircraft by track number and flight, without plots. Updates that only extrapolate or
        terminate a track, or are simulated, are excluded.

    Raises
    ------
    InputError
        It is missing, cannot be used, or is of several processors.
    """
    path = given / SYSTEM_TRACKS_FILE if given.is_dir() else given
    plots = pl.DataFrame(schema=_NO_PLOTS)
    if has_dump_tracks(given) and not (given / SYSTEM_TRACKS_FILE).exists():
        if processor is not None:
            raise InputError(
                f"{given}: a dump has the system tracks of one processor, without its SAC-SIC; "
                f"omit --processor {processor}"
            )
        recorded = dump_tracks(given)
        reference = reference_of_reports(recorded, str(given), settings.reference_gap_s, regions)
        return Known("system-tracks", given, reference, plots)
    if content(path) == TRACKS:
        raise InputError(no_such(path, _SYSTEM_TRACKS))
    frame = read_table(path, _SYSTEM_TRACKS)
    missing = [name for name in ("state", "sensor_id") if name not in frame.columns]
    if missing:
        raise MissingColumnError(str(path), missing, frame.columns)
    seen = ~pl.col("state").is_in(NOT_SEEN)
    located = of_one_processor(with_rows(frame), str(path), processor)
    usable = named_by_flight(located).filter(seen)
    if usable.is_empty():
        msg = f"{path}: {unseen_states(located)}"
        raise InputError(msg)
    reference = reference_of_reports(usable, str(path), settings.reference_gap_s, regions)
    claimed: dict[str, float | str] = {} if processor is None else {"processor": processor}
    return Known("system-tracks", given, reference, plots, claimed=claimed)


def read_smoothed(
    given: Path,
    sensors: Path,
    tracks: Path,
    settings: EvaluationSettings,
    smoother: str = "constant-velocity",
    *,
    regions: "Sequence[CoveredRegion]" = (),
) -> Known:
    """Smooth the measurements of a recording.

    Parameters
    ----------
    given : Path
        The folder that `convert` or `simulate` made, or its `measurements.parquet`.
    sensors : Path
        Sites and errors: sensors.toml.
    tracks : Path
        The folder that `track` made: its biases are subtracted from the plots.
    settings : EvaluationSettings
        Of which the gap of the reference and the density are used.
    smoother : str
        Motion model: see `smoothed_reference`.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.

    Returns
    -------
    Known
        With the reported accuracy of the smoothed positions.

    Raises
    ------
    InputError
        It does not exist or cannot be used.
    ConfigurationError
        The sensors cannot be used.
    """
    from multiradar.evaluation.smoothing.reference import smoothed_reference

    sensors_file = read_sensors(sensors)
    known_sensors = sensors_file.sensor
    frame, source = _measurements(given)
    findings = _findings(frame, wire.sensor_table(sensors_file))
    _warn_of_unknown(frame, [one.all_names() for one in known_sensors], sensors)
    biases = bias_tables(tracks, None)
    claimed: dict[str, float | str] = {"sensors": str(sensors), "smoother": smoother}
    if frame.select(aircraft_name()).to_series().null_count() == len(frame):
        frame = named_by_tracks(frame, known_sensors, tracks)
        claimed["identity"] = "tracks"
    made = smoothed_reference(
        frame,
        known_sensors,
        biases,
        source=source,
        density=settings.density,
        gap_s=settings.reference_gap_s,
        smoother=smoother,
        regions=regions,
    )
    plots = frame.filter(pl.col("kind") != "adsb")
    return Known(
        "smoothed",
        given,
        made.reference,
        plots.select("time_s", "sensor_id", aircraft_name()),
        claimed=claimed | {"sigma_m": made.sigma_m, "outliers": made.outliers},
        findings=tuple(findings),
    )


def recorded_rows(given: Path | None, *, may_be_empty: bool) -> pl.DataFrame | None:
    """Read a recording as far as an evaluation compares with it.

    Parameters
    ----------
    given : Path, optional
        The folder that `convert` or `simulate` made, or its `measurements.parquet`.
    may_be_empty : bool
        Whether it may have no rows: system tracks may come with an empty table of measurements.

    Returns
    -------
    DataFrame or None
        ``kind`` and the columns of `PLOT_COLUMNS`; None if nothing is given, or it has no rows.

    Raises
    ------
    InputError
        It does not exist or cannot be used.
    """
    from multiradar.evaluation.sensor_differences import PLOT_COLUMNS
    from multiradar.storage.recording import Recording, measurements_path

    if given is None or (may_be_empty and Recording(measurements_path(given)).rows == 0):
        return None
    frame, _ = _measurements(given)
    return frame.select("kind", *PLOT_COLUMNS)


# What makes the measurements unfit for a reference; names are compared by `_warn_of_unknown`.
def _findings(frame: pl.DataFrame, sensors: "SensorTable") -> list[str]:
    from multiradar.diagnosis.evidence import Evidence
    from multiradar.diagnosis.findings import diagnose

    known = [name for name, _ in sensors.aliases] + [*sensors.ids]
    named = frame.filter(pl.col("sensor_id").is_in(known)).sort("time_s")
    evidence = Evidence(sensors)
    evidence.record_rows(named)
    evidence.confirmed = True
    used = set(named["sensor_id"].unique().to_list())
    return [
        one.sentence
        for one in diagnose(evidence)
        if one.severity == "error" and one.sensor_id in used
    ]


def _warn_of_unknown(frame: pl.DataFrame, known: list[set[str]], sensors: Path) -> None:
    names = set().union(*known)
    found = frame.group_by("sensor_id").len().sort("sensor_id").rows()
    lost = [f"{name} ({count} measurements)" for name, count in found if name not in names]
    if lost:
        are, were = ("is", "was") if len(lost) == 1 else ("are", "were")
        warn(f"{', '.join(lost)} {are} not in {sensors} and {were} not used", DataWarning)


def _measurements(given: Path) -> tuple[pl.DataFrame, str]:
    from multiradar.storage.recording import Recording, measurements_path

    path = measurements_path(given)
    if not path.is_file():
        raise InputError(no_such(path, "the output of `convert` or `simulate`"))
    recording = Recording(path)
    if recording.rows == 0:
        msg = f"{recording.path}: no measurements"
        raise InputError(msg)
    return pl.concat(recording.blocks()), str(recording.path)
