"""System tracks of a recording in a file of ASTERIX, as `multiradar track --asterix` writes it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.asterix.recording import AsterixRecorder
    from multiradar.settings.service import Settings


@contextmanager
def new_recorder(
    path: Path | None, settings: "Settings", sensors: "SensorTable"
) -> "Iterator[AsterixRecorder | None]":
    """Open a recorder of system tracks on a new file; None without a path.

    The file appears under its name only after success.

    Raises
    ------
    OutputExistsError
        The path exists; it is not touched.
    InputError
        The folder does not exist, or the file cannot be written.
    """
    if path is None:
        yield None
        return
    from multiradar.runtime.asterix.options import channel_options
    from multiradar.runtime.asterix.recording import AsterixRecorder
    from multiradar.settings.asterix_output import AsterixOutputSettings
    from multiradar.storage.output_file import new_file

    users = settings.asterix.output or (AsterixOutputSettings(file=path),)
    options = channel_options(users[0])
    with new_file(path) as partial:
        recorder = AsterixRecorder(partial, sensors, settings.tracking_settings(), options)
        try:
            yield recorder
        finally:
            recorder.close()
