"""Inputs of commands: sensors, and measurements in any supported form."""

import datetime as dt
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from multiradar.cli.terminal.folders import no_such
from multiradar.errors import ConfigurationError, InputError
from multiradar_converters.leftovers import temporary_folder

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.storage.recording import Recording
    from multiradar_converters.vid.options import Options
    from multiradar_schemas.sensors.sensor import SensorsFile


#: Sensors of a run, kept beside its tracks.
SENSORS_FILE = "sensors.toml"


@dataclass(frozen=True, slots=True)
class DumpChoice:
    """Options for a dump that is converted on the fly.

    Attributes
    ----------
    date : str, optional
        Date of its first line.
    profile : Path, optional
        Its layout: names of files and columns.
    allow_missing : bool
        Whether it may lack tracks or ADS-B.
    """

    date: str | None = None
    profile: Path | None = None
    allow_missing: bool = False

    def check_unused(self, given: Path) -> None:
        """Reject options for a dump where the input is none: they would have no effect."""
        options = {
            "--date": self.date is not None,
            "--profile": self.profile is not None,
            "--allow-missing": self.allow_missing,
        }
        for option, wanted in options.items():
            if wanted:
                msg = f"{option} applies to a dump directory only; {given} is already converted"
                raise typer.BadParameter(msg)

    def options(self, **more: Any) -> "Options":
        """Return the options of the converter.

        Raises
        ------
        ConfigurationError
            The profile cannot be used.
        """
        from multiradar_converters.errors import ProfileError
        from multiradar_converters.vid.options import Options
        from multiradar_converters.vid.profile import load_profile

        try:
            profile = load_profile(self.profile)
        except ProfileError as error:
            raise ConfigurationError(str(error), error.source, error.reasons) from error
        day = None if self.date is None else dt.date.fromisoformat(self.date)
        return Options(date=day, profile=profile, allow_missing=self.allow_missing, **more)


def load_sensor_table(path: Path, sensors: "SensorsFile | None" = None) -> "SensorTable":
    """Return the sensors of a `sensors.toml`.

    Parameters
    ----------
    path : Path
        The file.
    sensors : SensorsFile, optional
        Its content, where that was changed.

    Raises
    ------
    ConfigurationError
        The file cannot be read or contains impossible values.
    """
    from multiradar import wire
    from multiradar.diagnosis.sites import check_sites

    table = wire.sensor_table(sensors or read_sensors(path))
    wrong = check_sites(table)
    if wrong is not None:
        msg = f"{path}: {wrong}"
        raise ConfigurationError(msg)
    return table


def read_sensors(path: Path) -> "SensorsFile":
    """Return the contents of a `sensors.toml`; see `load_sensor_table`."""
    from multiradar_schemas.errors import DocumentError
    from multiradar_schemas.sensors.sensor import load_sensors

    try:
        return load_sensors(path)
    except DocumentError as error:
        raise ConfigurationError(str(error), error.source, error.reasons) from error


@contextmanager
def open_measurements(given: Path, dump: DumpChoice, horizon_s: float) -> Iterator["Recording"]:
    """Open measurements: a Parquet file, a converted folder, or a dump, converted on the fly.

    Parameters
    ----------
    given : Path
        The file or folder.
    dump : DumpChoice
        Options for a dump.
    horizon_s : float
        Rows out of order by more than this, s, are sorted by time first.

    Yields
    ------
    Recording
        With at least one measurement; temporary files are removed afterwards.

    Raises
    ------
    InputError
        It cannot be read, or is empty.
    """
    from multiradar.storage.recording import MEASUREMENTS_FILE, Recording, measurements_path

    if not given.is_dir() or (given / MEASUREMENTS_FILE).exists():
        dump.check_unused(given)
        with _in_order(Recording(measurements_path(given)), given, horizon_s) as recording:
            yield recording
        return
    options = dump.options(kinds=())
    plots = options.profile.files.plots
    if not (given / plots).exists():
        raise InputError(no_such(given, f"a folder with {MEASUREMENTS_FILE}, or a dump"))
    with temporary_folder("multiradar-dump-") as temporary:
        from multiradar.cli.conversion.convert import convert_with_bar

        converted = temporary / "converted"
        # Only the table is needed: no files by aircraft.
        convert_with_bar(given, converted, options)
        measured = Recording(converted / MEASUREMENTS_FILE)
        with _in_order(measured, given, horizon_s) as recording:
            yield recording


@contextmanager
def _in_order(recording: "Recording", given: Path, horizon_s: float) -> Iterator["Recording"]:
    from multiradar.storage.time_order import disorder_s, in_time_order

    if recording.rows == 0:
        msg = f"{given}: no measurements"
        raise InputError(msg)
    disordered_s = disorder_s(recording)
    if disordered_s <= horizon_s:
        yield recording
        return
    print(
        f"multiradar: {given}: rows are up to {round(disordered_s, 1):.10g} s out of order; "
        "sorted by time first",
        file=sys.stderr,
    )
    with temporary_folder("multiradar-sort-") as temporary:
        yield in_time_order(recording, temporary)


def check_found(found: int, kinds: str | None, given: Path) -> None:
    """Raise `InputError` when there is no measurement of the kinds chosen."""
    if found == 0:
        msg = f"{given}: no measurements of the kinds {kinds}"
        raise InputError(msg)


def counts_by_code(rejected: dict[str, int]) -> str:
    """Return counts by reject code as text, the most frequent first."""
    ordered = sorted(rejected.items(), key=lambda item: (-item[1], item[0]))
    return ", ".join(f"{count} {code}" for code, count in ordered)
