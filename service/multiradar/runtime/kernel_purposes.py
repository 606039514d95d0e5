"""The kernels a run needs by its settings: purposes of `multiradar_compiled.kernel_list`."""

from collections.abc import Mapping, Sequence

import numpy as np

from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.settings import BY_PROBABILITY, TrackingSettings

#: Filters with their own kernels for extra outputs; the others share those of the first.
_LISTED_FILTERS = ("two-stage", "imm")


def track_purposes(
    settings: TrackingSettings, sensors: SensorTable, outputs: Mapping[str, object]
) -> list[str]:
    """Return the purposes of tracking a recording.

    Parameters
    ----------
    settings : TrackingSettings
        The filter, and how plots are associated.
    sensors : SensorTable
        The sensors: direction finders need additional kernels.
    outputs : mapping of str to object
        Further outputs by the options of the command, as in ``--encounters``; None: not wanted.

    Returns
    -------
    list of str
        Purposes.
    """
    name = settings.filter_name
    listed = name if name in _LISTED_FILTERS else _LISTED_FILTERS[0]
    wanted = [option for option, value in outputs.items() if value is not None]
    purposes = [f"track {name}", *(f"track {option} {listed}" for option in wanted)]
    if settings.association == BY_PROBABILITY:
        purposes.append(f"track probabilistic {listed}")
    if np.any(np.asarray(sensors.kinds) == KIND_BEARING):
        purposes.append(f"bearings {listed}")
    return purposes


def serve_purposes(
    settings: TrackingSettings,
    sensors: SensorTable,
    *,
    trajectories: bool,
    asterix: bool,
    feeds: bool = False,
) -> Sequence[str]:
    """Return the purposes of the service, including its queries.

    Parameters
    ----------
    settings : TrackingSettings
        The filter, and how plots are associated.
    sensors : SensorTable
        The sensors.
    trajectories : bool
        Whether tracks have trajectories.
    asterix : bool
        Whether it receives ASTERIX.
    feeds : bool
        Whether it reads feeds of receivers.

    Returns
    -------
    sequence of str
        Purposes.
    """
    purposes = track_purposes(settings, sensors, {"--trajectories": trajectories or None})
    purposes.append(f"serve {settings.filter_name}")
    if asterix:
        purposes.append("convert asterix")
    if feeds:
        purposes.append("convert adsb")
    return purposes
