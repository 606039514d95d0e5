"""The table of trajectories of an offline run: each bundle at the end of each epoch."""

from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl

from multiradar.errors import TrajectoryError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.queries.parameters import PATH_POINTS_DEFAULT
from multiradar.runtime.trajectories.document import trajectories_of
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.runtime.trajectories.plots import PlotLocator
from multiradar.runtime.trajectories.pool import ACCEPTED, BundlePool, Reading
from multiradar.runtime.trajectories.roster import Order, PushPlots, Roster, Sampled
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA

#: Returns rows of another table for a track, its bundle and the plane.
ExtraRows = Callable[[int, Reading, SystemPlane], list[dict[str, Any]]]
#: Whole seconds between the points of the paths in the table.
STEP_S = 5


class TrajectoryTable:
    """Computes the table with the same bundles as the service.

    Parameters
    ----------
    options : TrajectoryOptions
        Bounds and settings.
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    extra : callable, optional
        Returns rows of another table for a track and its bundle at the end of an epoch.
    """

    def __init__(
        self, options: TrajectoryOptions, sensors: SensorTable, tracking: TrackingSettings,
        extra: ExtraRows | None = None,
    ) -> None:  # fmt: skip
        locator = PlotLocator(sensors, tracking)
        #: The plane of the bundles.
        self.plane, self._epoch_s = locator.plane, tracking.epoch_s
        self._roster = Roster(options.aircraft_max, sensors)
        self._pool = BundlePool(locator, options.bundle)
        # Epoch and time of the last plot of each bundle, and rows of incomplete epochs.
        self._last: dict[int, tuple[int, float]] = {}
        self._rows: list[tuple[int, int, dict[str, Any]]] = []
        self._epoch: float = -np.inf
        # Rows of the other table by epoch and track, and those of completed epochs.
        self._extra = extra
        self._extra_rows: list[tuple[int, int, list[dict[str, Any]]]] = []
        self._extra_done: list[dict[str, Any]] = []

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the epochs completed by an output of the engine."""
        for order in self._roster.push(output):
            self._process(order)
        if len(output.updates):
            reached = float(np.floor(output.updates.time_s.max() / self._epoch_s))
            self._epoch = max(self._epoch, reached)
        self._add_rows_before(self._epoch)
        return self._frame(self._epoch)

    def finish(self) -> pl.DataFrame:
        """Return the rows of the last epoch."""
        self._add_rows_before(np.inf)
        return self._frame(np.inf)

    def pop_extra_rows(self) -> list[dict[str, Any]]:
        """Return the rows of the other table since the last call, of completed epochs."""
        found, self._extra_done = self._extra_done, []
        return found

    def counts(self) -> dict[str, Any]:
        """Return plots by outcome."""
        outcomes = dict(sorted(self._pool.outcomes.items()))
        return {
            "aircraft_waiting": self._roster.waiting,
            "plots_taken": outcomes.pop(ACCEPTED, 0),
            "plots_refused": outcomes,
            "restarts": self._pool.restarts,
        }

    def _process(self, order: Order) -> None:
        if isinstance(order, Sampled):
            self._sample(order)
            return
        track_id = order.track_id
        if not isinstance(order, PushPlots):
            self._add_row(track_id)
            self._pool.drop(track_id)
            return
        epochs = np.floor(order.plots["time_s"] / self._epoch_s).astype(np.int64).tolist()
        for plot, epoch in zip(order.plots, epochs, strict=True):
            if self._last.get(track_id, (epoch,))[0] < epoch:
                self._add_row(track_id)
            self._pool.push(track_id, plot, order.published)
            self._last[track_id] = epoch, float(plot["time_s"])

    # The rows of an epoch use the calibration up to its end.
    def _sample(self, sampled: Sampled) -> None:
        self._add_rows_before(sampled.epoch)
        self._pool.sample(sampled)
        self._add_rows_before(sampled.epoch + 1)

    def _add_rows_before(self, epoch: float) -> None:
        for track_id in [one for one, (last, _) in self._last.items() if last < epoch]:
            self._add_row(track_id)

    # Adds the row of a track's bundle at the end of an epoch, if it had a plot in it.
    def _add_row(self, track_id: int) -> None:
        last = self._last.pop(track_id, None)
        reading = self._pool.read(track_id)
        if last is None or reading is None:
            return
        epoch, time_s = last
        if self._extra is not None:
            self._extra_rows.append((epoch, track_id, self._extra(track_id, reading, self.plane)))
        try:
            document = trajectories_of(track_id, reading, self.plane, PATH_POINTS_DEFAULT, STEP_S)
            row = table_row(document)
        except TrajectoryError as error:
            row = {"track_id": track_id, "time_s": time_s, "reason": error.code}
        self._rows.append((epoch, track_id, row))

    def _frame(self, epoch: float) -> pl.DataFrame:
        done = sorted((row for row in self._rows if row[0] < epoch), key=lambda row: row[:2])
        self._rows = [row for row in self._rows if row[0] >= epoch]
        over = sorted((one for one in self._extra_rows if one[0] < epoch), key=lambda one: one[:2])
        self._extra_rows = [one for one in self._extra_rows if one[0] >= epoch]
        self._extra_done += [row for _, _, rows in over for row in rows]
        whole = [{name: row.get(name) for name in TRAJECTORY_SCHEMA} for _, _, row in done]
        return pl.DataFrame(whole, schema=TRAJECTORY_SCHEMA)


def table_row(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document of a bundle as a row of `trajectories.parquet`.

    Parameters
    ----------
    document : dict
        Result of `trajectories_of`.

    Returns
    -------
    dict
        Columns of `TRAJECTORY_SCHEMA`.
    """
    row = {**document["estimate"], **document}
    versions = document["trajectories"]
    segments = [
        {"trajectory": number, **segment}
        for number, version in enumerate(versions)
        for segment in version["segments"]
    ]
    row["weights"] = [version["weight"] for version in versions]
    row |= {f"segment_{name}": values for name, values in _columns(segments).items()}
    for by in ("best", "weighted"):
        columns = _columns(document[by])
        row["point_time_s"] = columns.pop("time_s", [])
        row |= {f"{by}_{name}": values for name, values in columns.items()}
    return row


def _columns(records: list[dict[str, Any]]) -> dict[str, list[Any]]:
    names = records[0] if records else {}
    return {name: [record[name] for record in records] for name in names}
