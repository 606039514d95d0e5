"""Which kernels a run needs, by its settings: purposes of `multiradar_compiled.wanted`."""

from collections.abc import Mapping, Sequence

import numpy as np

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.measurements import KIND_BEARING

#: Filters for which extra outputs are listed of their own; the others share those of the first.
_LISTED_FILTERS = ("two-stage", "imm")


def track_purposes(
    filter_name: str, sensors: SensorTable, outputs: Mapping[str, object]
) -> list[str]:
    """Return what tracking a recording needs.

    Parameters
    ----------
    filter_name : str
        The filter.
    sensors : SensorTable
        The sensors: direction finders need kernels of their own.
    outputs : mapping of str to object
        Further outputs by the options of the command, as in ``--encounters``; None: not wanted.

    Returns
    -------
    list of str
        Purposes.
    """
    listed = filter_name if filter_name in _LISTED_FILTERS else _LISTED_FILTERS[0]
    wanted = [option for option, value in outputs.items() if value is not None]
    purposes = [f"track {filter_name}", *(f"track {option} {listed}" for option in wanted)]
    if np.any(np.asarray(sensors.kinds) == KIND_BEARING):
        purposes.append(f"bearings {listed}")
    return purposes


def serve_purposes(
    filter_name: str, sensors: SensorTable, *, trajectories: bool, asterix: bool
) -> Sequence[str]:
    """Return what the service needs, its queries included.

    Parameters
    ----------
    filter_name : str
        The filter.
    sensors : SensorTable
        The sensors.
    trajectories : bool
        Whether tracks have trajectories.
    asterix : bool
        Whether it receives ASTERIX.

    Returns
    -------
    sequence of str
        Purposes.
    """
    purposes = track_purposes(filter_name, sensors, {"--trajectories": trajectories or None})
    purposes.append(f"serve {filter_name}")
    if asterix:
        purposes.append("convert asterix")
    return purposes
