"""Tables of evaluated tracks, their sensors, and the coverage of these."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from multiradar.errors import InputError, MissingColumnError, OutsidePlaneError
from multiradar.evaluation.measures.bias_errors import BiasHistory, bias_histories
from multiradar.evaluation.measures.update_times import UPDATE_TIME, with_ids, with_update_times
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.tables import TRACK_COLUMNS, tracks_of
from multiradar.toolbox.inputs import SENSORS_FILE, read_sensors
from multiradar_schemas.documents.contents import no_such, other_table, unreadable
from multiradar_schemas.sensors.sensor import Sensor

if TYPE_CHECKING:
    from multiradar.evaluation.coverage import CoveredRegion
    from multiradar.evaluation.trajectories import Tracks
    from multiradar.toolbox.evaluation.known import Known

TRACKS_FILE = "tracks.parquet"
BIASES_FILE = "biases.parquet"
FORECAST_FILES = ("forecasts.parquet", "bundle_forecasts.parquet")


def sensors_file(given: Path, sensors: Path | None) -> Path | None:
    """Return the sensors file of tracks: the one given, or the one next to them.

    Parameters
    ----------
    given : Path
        The folder that `track` made, or its `tracks.parquet`.
    sensors : Path, optional
        A sensors file.

    Returns
    -------
    Path or None
        None if there is neither.
    """
    if sensors is not None:
        return sensors
    beside = given / SENSORS_FILE
    return beside if beside.is_file() else None


def read_regions(given: Path, sensors: Path | None) -> "list[CoveredRegion]":
    """Return the coverage of the sensors that updated tracks.

    Parameters
    ----------
    given : Path
        The folder that `track` made, or its `tracks.parquet`.
    sensors : Path, optional
        Their sensors file.

    Returns
    -------
    list of CoveredRegion
        Empty without a sensors file.

    Raises
    ------
    InputError
        The tracks are missing or cannot be used.
    ConfigurationError
        The sensors cannot be used.
    """
    from multiradar.evaluation.coverage import covered_regions

    if sensors is None:
        return []
    path, frame = _tracks_table(given)
    missing = [name for name in TRACK_COLUMNS if name not in frame.columns]
    if missing:
        raise MissingColumnError(
            str(path), missing, frame.columns, other_table(frame.columns, missing)
        )
    return covered_regions(frame, read_sensors(sensors).sensor)


def read_tracks(given: Path, known: "Known", settings: EvaluationSettings) -> "Tracks":
    """Read the tracks to evaluate.

    Parameters
    ----------
    given : Path
        The folder that `track` made, or its `tracks.parquet`.
    known : Known
        The reference, which defines the plane.
    settings : EvaluationSettings
        Whether tentative tracks count.

    Returns
    -------
    Tracks
        By track, then time.

    Raises
    ------
    InputError
        It does not exist or cannot be used.
    """
    path, frame = _tracks_table(given)
    try:
        return tracks_of(frame, str(path), known.reference.plane, tentative=settings.tentative)
    except OutsidePlaneError as error:
        msg = (
            f"{path}: the tracks and the reference {known.path} are on different sides of the "
            "Earth; check that both come from the same recording and that latitude and "
            "longitude are not swapped"
        )
        raise InputError(msg) from error


def read_biases(given: Path, known: "Known") -> list[BiasHistory]:
    """Read the biases next to the tracks, with their truth if it is known.

    Parameters
    ----------
    given : Path
        The folder that `track` made; a single file has no biases next to it.
    known : Known
        Where the truth may be.

    Returns
    -------
    list of BiasHistory
        Empty if there are no biases.

    Raises
    ------
    InputError
        A table cannot be used.
    """
    return bias_tables(given, known.true_biases)


def read_forecasts(given: Path) -> list[tuple[pl.DataFrame, str]]:
    """Read the forecasts next to the tracks.

    Parameters
    ----------
    given : Path
        The folder that `track` made; a single file has no forecasts next to it.

    Returns
    -------
    list of (DataFrame, str)
        Each table, and its name in error messages.

    Raises
    ------
    InputError
        One of them is not a Parquet file.
    """
    if not given.is_dir():
        return []
    paths = [given / name for name in FORECAST_FILES]
    return [(read_table(path, "forecasts"), str(path)) for path in paths if path.exists()]


def read_table(path: Path, what: str) -> pl.DataFrame:
    """Read a Parquet file.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it should contain.

    Raises
    ------
    InputError
        It does not exist, or is not a Parquet file.
    """
    if not path.is_file():
        raise InputError(no_such(path, what))
    try:
        return pl.read_parquet(path)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise InputError(unreadable(path, what, error)) from error


def named_by_tracks(
    measurements: pl.DataFrame, sensors: Sequence[Sensor], given: Path
) -> pl.DataFrame:
    """Name measurements without identity by the confirmed tracks that they updated.

    Parameters
    ----------
    measurements : DataFrame
        Rows of `measurements.parquet`.
    sensors : sequence of Sensor
        Their sensors.
    given : Path
        The folder that `track` made, or its `tracks.parquet`.

    Returns
    -------
    DataFrame
        With the identifier of the track as `track_number`. Where a sensor has several measurements
        at one time, the one of an update is ambiguous, and they keep none.

    Raises
    ------
    InputError
        The tracks cannot be used, or none of the measurements updated them.
    """
    key = (UPDATE_TIME, "sensor_id")
    path, frame = _tracks_table(given)
    missing = [name for name in TRACK_COLUMNS if name not in frame.columns]
    if missing:
        raise MissingColumnError(
            str(path), missing, frame.columns, other_table(frame.columns, missing)
        )
    updates = frame.filter(pl.col("state") == "confirmed").rename({"time_s": UPDATE_TIME})
    updates = with_ids(updates, sensors).filter(pl.len().over(key) == 1)
    named = with_update_times(measurements, sensors).drop("track_number").join(
        updates.select(*key, pl.col("track_id").cast(pl.Int64).alias("track_number")),
        on=key, how="left", maintain_order="left",
    )  # fmt: skip
    number = pl.when(pl.len().over(key) == 1).then("track_number")
    named = named.with_columns(number.alias("track_number")).drop(UPDATE_TIME)
    if named["track_number"].null_count() == len(named):
        msg = (
            "--smoothed requires measurements with identity: none has a track number or a Mode S "
            f"address, and none coincides in time with an update of a confirmed track in {path}"
        )
        raise InputError(msg)
    return named


def _tracks_table(given: Path) -> tuple[Path, pl.DataFrame]:
    path = given / TRACKS_FILE if given.is_dir() else given
    return path, read_table(path, "the output of `track`")


def bias_tables(given: Path, truth: tuple[pl.DataFrame, str] | None) -> list[BiasHistory]:
    """Read the biases next to the tracks, with a table of true ones and its name in errors.

    Raises
    ------
    InputError
        A table cannot be used.
    """
    path = given / BIASES_FILE
    if not given.is_dir() or not path.exists():
        return []
    found = read_table(path, "biases")
    return bias_histories(found, str(path), *(truth or (None, "")))
