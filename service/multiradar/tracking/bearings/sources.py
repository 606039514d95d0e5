"""What bearings are seen from, where that is not the site of their sensor, and elevations.

The filters find the site of a row, its noise and its columns in the bias vector in `Model`, by
`Rows.seen`. A bearing of a moving source has a site of its own there, one with an elevation a noise
of its own: rows behind those of the sensors. No kernel asks whether a source moves, and what is no
such bearing does not notice.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Rows
from multiradar.estimation.measurement._kernels import KIND_DIRECTION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy._kernels import site_parameters
from multiradar.tracking.input.measurements import MeasurementBatch

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Sources(NamedTuple):
    """What `Model` has of sites, of those of single bearings too.

    Attributes
    ----------
    sites, noises : (k, …) float64
        As in `Model`, those of bearings behind those of sensors.
    starts : (k + 1,) int64
        As in `Model`: the first and last column of row q are at q and q + 1.
    """

    sites: Floats
    noises: Floats
    starts: Integers

    def within(self, model: Model) -> Model:
        """Return the model with these sites."""
        return model._replace(**self._asdict())


def find_sources(
    batch: MeasurementBatch, rows: Rows, model: Model, sensors: SensorTable
) -> tuple[Rows, Sources | None]:
    """Give bearings of moving sources, and those with an elevation, what is their own.

    Parameters
    ----------
    batch : MeasurementBatch
        The measurements.
    rows : Rows
        The same as the filters take them; bearings with an elevation become directions.
    model : Model
        What all aircraft share.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    Rows
        With the places of sites and noises.
    Sources or None
        What is at these places; None where all of it is that of the sensors.
    """
    told = batch.directions
    if told is None:
        return rows, None
    elevated, moves = ~np.isnan(told.elevation_rad), told.moves
    own = np.flatnonzero(elevated | moves)
    # A row of `starts` needs the place behind it as well.
    first = len(model.sites) + 1
    places = first + 2 * np.arange(len(own))
    sites = np.zeros((first + 2 * len(own), model.sites.shape[1]))
    noises = np.zeros((len(sites), model.noises.shape[1]))
    starts = np.zeros(len(sites) + 1, np.int64)
    sites[: first - 1], noises[: first - 1], starts[:first] = (
        model.sites, model.noises, model.starts,
    )  # fmt: skip
    of = rows.sensor[own]
    sites[places], noises[places] = model.sites[of], model.noises[of]
    starts[places], starts[places + 1] = model.starts[of], model.starts[of + 1]
    noises[places, 0] = sensors.elevation_sigma_rad[of] ** 2
    for place, row in zip(places[moves[own]].tolist(), own[moves[own]].tolist(), strict=True):
        height_m = float(told.source_height_m[row])
        sites[place] = site_parameters(
            model.plane, float(told.source_latitude_rad[row]),
            float(told.source_longitude_rad[row]), height_m,
        )  # fmt: skip
        noises[place, 3] = height_m
    seen, kind, z = rows.sensor.copy(), rows.kind.copy(), rows.z.copy()
    seen[own] = places
    kind[elevated] = KIND_DIRECTION
    z[elevated, 0] = np.sin(told.elevation_rad[elevated])
    return rows._replace(seen=seen, kind=kind, z=z), Sources(sites, noises, starts)
