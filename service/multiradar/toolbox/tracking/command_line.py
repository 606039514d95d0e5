"""The command line that repeats a run of `track`."""

import shlex
from collections.abc import Collection
from pathlib import Path

from multiradar.toolbox.output import PathLike
from multiradar.toolbox.tracking.request import TrackOptions


def track_command(
    measurements: str,
    sensors: str,
    filter_name: str,
    *,
    kinds: Collection[str] | None = None,
    hide: Collection[str] | None = None,
    out: PathLike | None = None,
    options: TrackOptions | None = None,
) -> str:
    """Return the command line of a run: its filter, and each option that was given.

    Parameters
    ----------
    measurements, sensors : str
        Names of the recording and of the sensors.
    filter_name : str
        Name of the filter, also where it is the default or that of a settings file.
    kinds, hide, out, options
        As of `track`.

    Returns
    -------
    str
        One line for a shell.
    """
    given: dict[str, object] = {"filter": filter_name}
    # A set has no order; the output does not depend on it.
    for name, names in (("kinds", kinds), ("hide", hide)):
        given[name] = None if names is None else ",".join(sorted(names))
    given |= {"out": out, **(options or {})}
    parts = ["multiradar", "track", measurements, "--sensors", sensors]
    for name, value in given.items():
        flag = f"--{name.replace('_', '-')}"
        if value is None or value is False:
            continue
        if value is True:
            parts.append(flag)
        elif isinstance(value, str | Path):
            parts += [flag, str(value)]
        elif isinstance(value, float):
            parts += [flag, f"{value:.15g}"]
        elif isinstance(value, Collection):
            parts += [part for one in value for part in (flag, str(one))]
        else:
            parts += [flag, str(value)]
    return shlex.join(parts)
