"""Sites of moving sources, and noise of elevations and of positions, of single measurements.

The filters look up site, noise and bias columns of a row in `Model`, by `Rows.seen`. A bearing of a
moving source has its own site there, one with an elevation and a position with an accuracy its own
noise, in rows after those of the sensors. Kernels need not know of them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Rows
from multiradar.estimation.measurement.kinds import KIND_DIRECTION, KIND_POSITION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy._kernels import site_parameters
from multiradar.tracking.input.measurements import MeasurementBatch

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Sources(NamedTuple):
    """Site arrays of `Model`, including those of single measurements.

    Attributes
    ----------
    sites, noises : (k, …) float64
        As in `Model`; those of measurements follow those of sensors.
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
    """Add sites of moving sources, and noise of elevations and positions.

    Parameters
    ----------
    batch : MeasurementBatch
        The measurements.
    rows : Rows
        The same in the form of the filters; bearings with an elevation become directions.
    model : Model
        Model common to all aircraft.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    Rows
        With the row numbers of sites and noises.
    Sources or None
        The arrays; None if there are only those of the sensors.
    """
    directions, sigma_m = batch.directions, batch.position_sigma_m
    if directions is None and sigma_m is None:
        return rows, None
    elevated, moves = np.zeros((2, len(batch)), np.bool_)
    if directions is not None:
        elevated, moves = ~np.isnan(directions.elevation_rad), directions.moves
    bearings = np.flatnonzero(elevated | moves)
    seen, kind, z = rows.sensor.copy(), rows.kind.copy(), rows.z.copy()
    # A row of `starts` also uses the next entry.
    first = len(model.sites) + 1
    seen[bearings] = first + 2 * np.arange(len(bearings))
    accurate, noise = np.empty(0, np.intp), np.empty((0, 2))
    if sigma_m is not None:
        # Few accuracies occur: rows of equal ones share an entry.
        accurate = np.flatnonzero((rows.kind == KIND_POSITION) & ~np.isnan(sigma_m))
        pairs = np.stack([rows.sensor[accurate], sigma_m[accurate]], axis=1)
        noise, place = np.unique(pairs, axis=0, return_inverse=True)
        seen[accurate] = first + 2 * (len(bearings) + place.ravel())
    entries = first + 2 * np.arange(len(bearings) + len(noise))
    sites = np.zeros((first + 2 * len(entries), model.sites.shape[1]))
    noises = np.zeros((len(sites), model.noises.shape[1]))
    starts = np.zeros(len(sites) + 1, np.int64)
    sites[: first - 1], noises[: first - 1], starts[:first] = (
        model.sites, model.noises, model.starts,
    )  # fmt: skip
    of = np.concatenate([rows.sensor[bearings], noise[:, 0].astype(np.int64)])
    sites[entries], noises[entries] = model.sites[of], model.noises[of]
    starts[entries], starts[entries + 1] = model.starts[of], model.starts[of + 1]
    noises[entries[len(bearings) :], 2] = noise[:, 1] ** 2
    noises[seen[bearings], 0] = sensors.elevation_sigma_rad[rows.sensor[bearings]] ** 2
    if directions is not None:
        for row in np.flatnonzero(moves).tolist():
            height_m = float(directions.source_height_m[row])
            sites[seen[row]] = site_parameters(
                model.plane, float(directions.source_latitude_rad[row]),
                float(directions.source_longitude_rad[row]), height_m,
            )  # fmt: skip
            noises[seen[row], 3] = height_m
        kind[elevated] = KIND_DIRECTION
        z[elevated, 0] = np.sin(directions.elevation_rad[elevated])
    return rows._replace(seen=seen, kind=kind, z=z), Sources(sites, noises, starts)
