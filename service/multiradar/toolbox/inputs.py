"""Inputs of commands: sensors, and measurements in any supported form."""

import datetime as dt
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.clock import SystemClock
from multiradar.errors import ArgumentError, ConfigurationError, DataWarning, InputError
from multiradar.toolbox.arguments import checked_value, typed
from multiradar.toolbox.messages.warning import warn
from multiradar.toolbox.output import PathLike
from multiradar_converters.leftovers import temporary_folder

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar_converters.vid.options import Options
    from multiradar_schemas.sensors.sensor import SensorsFile


#: No recording is older.
_FIRST_DAY = dt.date(1970, 1, 1)
_DAY_S, _UNIX_MAX_S = 86_400.0, 1e11
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

    def check_unused(self, given: object) -> None:
        """Reject options for a dump if the input is not a dump: they would have no effect."""
        options = {
            "date": self.date is not None,
            "profile": self.profile is not None,
            "allow_missing": self.allow_missing,
        }
        for option, wanted in options.items():
            if wanted:
                raise ArgumentError(
                    f"`{option}` applies to a dump directory only; {given} is already converted",
                    option,
                )

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
        day = parse_day(self.date)
        return Options(date=day, profile=profile, allow_missing=self.allow_missing, **more)


def parse_day(text: str | None, *, warned: bool = True) -> dt.date | None:
    """Return a date such as 2018-08-01; None without a text. Warn about an impossible date.

    Raises
    ------
    ArgumentError
        It is not a date.
    """
    try:
        day = None if text is None else dt.date.fromisoformat(text)
    except (TypeError, ValueError) as error:
        msg = f"`date`: expected a date such as 2018-08-01, was {text!r}"
        raise ArgumentError(msg, "date") from error
    # Half the Earth is a day ahead; the clock of this computer may be wrong, so this is no error.
    last = dt.datetime.fromtimestamp(SystemClock().now_s(), dt.UTC).date() + dt.timedelta(days=1)
    if warned and day is not None and (day > last or day < _FIRST_DAY):
        when = "in the future" if day > last else "earlier than any recording"
        warn(
            f"date {day}: {when}; check the date, which determines the times of the output",
            DataWarning,
        )
    return day


def in_future(span_s: tuple[float, float] | None) -> list[str]:
    """Return a warning if the last of (first, last) Unix times is more than a day ahead."""
    last_s = 0.0 if span_s is None else span_s[1]
    # Larger ones are in another unit, which has its own message.
    if not SystemClock().now_s() + _DAY_S < last_s < _UNIX_MAX_S:
        return []
    day = dt.datetime.fromtimestamp(last_s, dt.UTC).date()
    return [
        f"times up to {day} are in the future; do they count from an epoch other than 1970-01-01?"
    ]


def check_sensors_argument(given: object) -> None:
    """Check that an argument is the path of a sensors file, or its contents.

    Raises
    ------
    ArgumentError
        It is neither a path nor a `SensorsFile`.
    """
    from multiradar_schemas.sensors.sensor import SensorsFile

    if not isinstance(given, str | Path | SensorsFile):
        msg = (
            "`sensors`: expected the path of a sensors.toml, or the result of load_sensors, was "
            f"{type(given).__name__}"
        )
        raise ArgumentError(msg, "sensors")


def load_sensor_table(
    path: Path, sensors: "SensorsFile | None" = None, name: str | None = None
) -> "SensorTable":
    """Return the sensors of a `sensors.toml`.

    Parameters
    ----------
    path : Path
        The file.
    sensors : SensorsFile, optional
        Its contents, if they were changed.
    name : str, optional
        Its name in errors; the path by default.

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
        msg = f"{name or path}: {wrong}"
        raise ConfigurationError(msg)
    return table


@typed
def read_sensors(path: PathLike) -> "SensorsFile":
    """Return the contents of a `sensors.toml`.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    SensorsFile
        `.sensor`: the sensors, in the order of the file, with units as in docs/reference/fields.md.

    Raises
    ------
    ConfigurationError
        The file cannot be read or contains impossible values; each mistake with its line.
    """
    from multiradar_schemas.errors import DocumentError
    from multiradar_schemas.sensors.sensor import load_sensors

    try:
        return load_sensors(Path(path))
    except DocumentError as error:
        raise ConfigurationError(str(error), error.source, error.reasons) from error


@contextmanager
def as_sensors_file(given: object) -> Iterator[tuple[Path, str]]:
    """Provide sensors as a file, and their name in errors.

    Parameters
    ----------
    given : str, Path or SensorsFile
        A `sensors.toml`, or its contents.

    Yields
    ------
    Path, str
        The file, removed afterwards if it was made here.

    Raises
    ------
    ArgumentError
        It is neither a path nor a `SensorsFile`.
    """
    from multiradar.simulation.scenario.toml_text import toml_text
    from multiradar_schemas.sensors.sensor import SensorsFile

    if isinstance(given, str | Path):
        path = Path(checked_value("sensors", given, PathLike))
        if path.exists() and not (path.is_file() or path.is_dir()):
            msg = f"{path}: expected a file, was a pipe or a device; write the sensors to a file"
            raise ConfigurationError(msg)
        yield path, str(given)
        return
    check_sensors_argument(given)
    assert isinstance(given, SensorsFile)
    with temporary_folder("multiradar-sensors-") as folder:
        path = folder / SENSORS_FILE
        tables = [one.model_dump(mode="json", exclude_unset=True) for one in given.sensor]
        path.write_text(toml_text({"sensor": tables}), encoding="utf-8")
        yield path, "sensors"


def check_found(found: int, kinds: Collection[str] | None, name: object) -> None:
    """Raise `InputError` when there is no measurement of the kinds chosen."""
    if found == 0:
        msg = f"{name}: no measurements of the kinds {','.join(sorted(kinds or ()))}"
        raise InputError(msg)


def counts_by_code(rejected: dict[str, int]) -> str:
    """Return counts by reject code as text, the most frequent first."""
    ordered = sorted(rejected.items(), key=lambda item: (-item[1], item[0]))
    return ", ".join(f"{count} {code}" for code, count in ordered)
