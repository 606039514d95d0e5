"""How to see a run on a map, for the end of the summaries of commands."""

import shlex
from pathlib import Path


def view_hint(tracks: Path, measurements: Path | None = None) -> str:
    """Return the line that names the command.

    Parameters
    ----------
    tracks : Path
        The output of `track`.
    measurements : Path, optional
        Its measurements; named only where `view` reads them, which is not the case for a dump.
    """
    from multiradar.storage.recording import measurements_path

    command = ["multiradar", "view", _shown(tracks)]
    if measurements is not None:
        file = measurements_path(measurements)
        if file.is_file() and file.suffix == ".parquet":
            command += ["--measurements", _shown(measurements)]
    return f"to show this on a map: {shlex.join(command)}"


# A name that begins with a dash would be read as an option.
def _shown(path: Path) -> str:
    return f"./{path}" if str(path).startswith("-") else str(path)
