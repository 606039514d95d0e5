"""The measurements of updates as rows, as they are retained."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import INNOVATION_COUNT
from multiradar.tracking.columns import row_type
from multiradar.tracking.input.measurements import Directions, MeasurementBatch
from multiradar.tracking.outputs import INNOVATIONS_COUNT, EngineOutput

#: Maximum measurements of a window; the last ones are used.
POINTS_MAX = 1000

# Identity is not kept.
_MEASURED = (
    "time_s", "sensor", "kind", "range_m", "azimuth_rad", "latitude_rad", "longitude_rad",
    "height_m",
)  # fmt: skip
# Estimated position after the measurement: columns of the update.
_OF_TRACK = "track_"
_TRACK = ("latitude_rad", "longitude_rad", "height_m")
# NaN where that of the sensor applies.
_ACCURACY = "position_sigma_m"
# Elevations and positions of moving sensors, side by side; NaN where not reported.
_DIRECTIONS = "directions"
# What the filter made of it, as in `EngineOutput.innovations`; NaN where it is not recorded.
_INNOVATION = "innovation"
#: Number of a track in rows of measurements that updated none.
NO_TRACK = 0
#: Columns of the variances of the noise in the innovation.
VARIANCES = slice(INNOVATION_COUNT, INNOVATIONS_COUNT)
#: The measurement of an update; field names are those of `MeasurementBatch`, and of the update with
#: the prefix `track_`.
PLOT_DTYPE = np.dtype(
    [("track_id", np.int64)]
    + row_type(MeasurementBatch, _MEASURED).descr
    + [(_ACCURACY, np.float64)]
    + [(_OF_TRACK + name, np.float64) for name in _TRACK]
    + [(_DIRECTIONS, np.float64, (len(Directions._fields),))]
    + [(_INNOVATION, np.float32, (INNOVATIONS_COUNT,))]
)


def plot_rows(output: EngineOutput, row_type: np.dtype[np.void] = PLOT_DTYPE) -> NDArray[np.void]:
    """Return the measurements of the updates of an output as rows.

    Parameters
    ----------
    output : EngineOutput
        Output of the engine.
    row_type : dtype
        `track_id`, columns of `MeasurementBatch`, and columns of `TrackUpdates` with the prefix
        `track_`.

    Returns
    -------
    (n,) ndarray of the type of the rows
        In the order of the updates.
    """
    plots, updates = output.plots, output.updates
    rows = np.empty(len(plots), row_type)
    for name in row_type.names or ():
        if name == "track_id":
            rows[name] = plots.track_id
        elif name.startswith(_OF_TRACK):
            rows[name] = getattr(updates, name.removeprefix(_OF_TRACK))
        elif name == _ACCURACY:
            rows[name] = plots.measured.accuracies()
        elif name == _DIRECTIONS:
            directions = plots.measured.directions
            rows[name] = np.nan if directions is None else np.column_stack(directions)
        elif name == _INNOVATION:
            rows[name] = output.innovations if len(output.innovations) else np.nan
        else:
            rows[name] = getattr(plots.measured, name)
    return rows


def rows_without_track(batch: MeasurementBatch) -> NDArray[np.void]:
    """Return measurements that updated no track as rows of `PLOT_DTYPE`, with track `NO_TRACK`."""
    rows = np.zeros(len(batch), PLOT_DTYPE)
    for name in (*(_OF_TRACK + one for one in _TRACK), _DIRECTIONS, _INNOVATION):
        rows[name] = np.nan
    for name in _MEASURED:
        rows[name] = getattr(batch, name)
    rows[_ACCURACY] = batch.accuracies()
    if batch.directions is not None:
        rows[_DIRECTIONS] = np.column_stack(batch.directions)
    return rows


def measurement_rows(output: EngineOutput) -> NDArray[np.void]:
    """Return all measurements of an output, used or not, as rows of `PLOT_DTYPE`, by time."""
    rows = plot_rows(output) if len(output.plots) else np.empty(0, PLOT_DTYPE)
    if not len(output.unused):
        return rows
    rows = np.concatenate([rows, rows_without_track(output.unused)])
    ordered: NDArray[np.void] = rows[np.argsort(rows["time_s"], kind="stable")]
    return ordered
