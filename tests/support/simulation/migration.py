"""Migration of the journal of a run while no process of the service runs."""

import contextlib
import json
from pathlib import Path
from typing import Any

from multiradar.errors import MultiradarError
from multiradar.settings.service import Settings
from multiradar.storage.backup import DATABASE
from multiradar.toolbox.operation.migration import migrate
from multiradar_schemas.sensors.sensor import SensorsFile
from support.simulation.process import JOURNAL
from support.simulation.record import require


class _Killed(Exception):  # noqa: N818  # the name of what it is
    pass


def migrated(
    image: dict[str, bytes], folder: Path, sensors: SensorsFile, *, killed: bool
) -> dict[str, bytes] | MultiradarError:
    """Migrate a journal; a migration that is killed before it is repeated.

    Parameters
    ----------
    image : dict of str to bytes
        The files of the service that has ended.
    folder : Path
        A folder to create for both journals.
    sensors : SensorsFile
        The sensors of the new journal.
    killed : bool
        Whether the first migration is killed before its end.

    Returns
    -------
    dict of str to bytes
        The files of the new journal; or the error with which none was written.
    """
    old, new = folder / "old", folder / "new"
    for name, content in image.items():
        (old / name).parent.mkdir(parents=True, exist_ok=True)
        (old / name).write_bytes(content)
    described = folder / "sensors.toml"
    described.write_text("\n".join(_described(sensors)))
    settings = Settings(sensors=described)
    if killed:
        try:
            with contextlib.suppress(_Killed):
                migrate(old / JOURNAL, new, settings, _run, _kill)
        except MultiradarError as error:
            return error
        require(not new.exists(), "I8", "a migration that was killed has left a state")
    try:
        done = migrate(old / JOURNAL, new, settings, _run)
    except MultiradarError as error:
        require(not new.exists(), "I8", "a migration that failed has left a state")
        return error
    changed = [name for name, content in image.items() if (old / name).read_bytes() != content]
    require(not changed, "I8", f"a migration has changed {changed}")
    rejected = done.accepted_before - done.accepted
    require(rejected == sum(done.rejected_now.values()), "I1", f"{rejected}, {done.rejected_now}")
    return {
        path.name.replace(DATABASE, JOURNAL): path.read_bytes()
        for path in new.iterdir()
        if path.is_file()
    }


def _run(*_: object) -> dict[str, Any]:
    # The service that is started next replays it.
    return {}


def _kill(_done: int, _total: int) -> None:
    raise _Killed


def _described(sensors: SensorsFile) -> list[str]:
    lines = []
    for one in sensors.sensor:
        given = one.model_dump(mode="json", exclude_unset=True)
        lines += ["[[sensor]]", *(f"{name} = {json.dumps(it)}" for name, it in given.items())]
    return lines
