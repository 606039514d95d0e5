"""What commands read: sensors, and measurements in whatever form they are given."""

import datetime as dt
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.errors import ConfigurationError, InputError

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.storage.recording import Recording


def load_sensor_table(path: Path) -> "SensorTable":
    """Return the sensors of a `sensors.toml`.

    Raises
    ------
    ConfigurationError
        The file cannot be read or says something impossible.
    """
    from multiradar import wire
    from multiradar_schemas.errors import SchemaError
    from multiradar_schemas.sensor import load_sensors

    try:
        return wire.sensor_table(load_sensors(path))
    except SchemaError as error:
        raise ConfigurationError(str(error)) from error


@contextmanager
def open_measurements(given: Path, date: str | None) -> Iterator["Recording"]:
    """Open measurements: a Parquet file, a converted folder, or a dump, converted on the way.

    Parameters
    ----------
    given : Path
        The file or folder.
    date : str, optional
        Date of the first line of a dump.

    Yields
    ------
    Recording
        The measurements; those of a dump are in a temporary folder that is removed afterwards.
    """
    from multiradar.storage.recording import MEASUREMENTS_FILE, Recording, measurements_path

    if not given.is_dir() or (given / MEASUREMENTS_FILE).exists():
        yield Recording(measurements_path(given))
        return
    if not (given / "plots.txt").exists():
        msg = f"{given}: expected {MEASUREMENTS_FILE} or the plots.txt of a dump, found neither"
        raise InputError(msg)
    with tempfile.TemporaryDirectory(prefix="multiradar-dump-") as temporary:
        converted = Path(temporary) / "converted"
        _convert_dump(given, converted, date)
        yield Recording(converted / MEASUREMENTS_FILE)


def _convert_dump(dump: Path, out: Path, date: str | None) -> None:
    from multiradar.cli.convert import convert_with_bar
    from multiradar_converters.vid.options import Options

    day = None if date is None else dt.date.fromisoformat(date)
    # The table is all that is wanted: no files for each aircraft.
    convert_with_bar(dump, out, Options(kinds=(), date=day))
