"""The table of trajectories of a run without service: each bundle as it ends each epoch."""

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
from multiradar.runtime.trajectories.plots import PlotPlaces
from multiradar.runtime.trajectories.pool import TAKEN, BundlePool, Reading
from multiradar.runtime.trajectories.roster import Order, Roster, Sampled, Take
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA

#: Rows of another table, of a track and its bundle on its plane.
Also = Callable[[int, Reading, SystemPlane], list[dict[str, Any]]]
#: Whole seconds between the points of the paths in the table.
STEP_S = 5


class TrajectoryTable:
    """Makes the table; the same bundles as those of a service.

    Parameters
    ----------
    options : TrajectoryOptions
        Bounds and rules.
    sensors : SensorTable
        Who measures.
    tracking : TrackingSettings
        Settings of the tracker.
    also : callable, optional
        Returns rows of another table, given a track and its bundle as it ends an epoch.
    """

    def __init__(
        self, options: TrajectoryOptions, sensors: SensorTable, tracking: TrackingSettings,
        also: Also | None = None,
    ) -> None:  # fmt: skip
        places = PlotPlaces(sensors, tracking)
        #: The plane that bundles are on.
        self.plane, self._epoch_s = places.plane, tracking.epoch_s
        self._roster = Roster(options.aircraft_max, sensors)
        self._pool = BundlePool(places, options.bundle)
        # Epoch and time of the last plot of each bundle, and rows of epochs that are not over.
        self._last: dict[int, tuple[int, float]] = {}
        self._rows: list[tuple[int, int, dict[str, Any]]] = []
        self._epoch: float = -np.inf
        # What else is said of bundles, by epoch and track, and that of epochs that are over.
        self._also = also
        self._said: list[tuple[int, int, list[dict[str, Any]]]] = []
        self._over: list[dict[str, Any]] = []

    def take(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the epochs that an output of the engine ends."""
        for order in self._roster.take(output):
            self._follow(order)
        if len(output.updates):
            reached = float(np.floor(output.updates.time_s.max() / self._epoch_s))
            self._epoch = max(self._epoch, reached)
        self._tell_before(self._epoch)
        return self._frame(self._epoch)

    def finish(self) -> pl.DataFrame:
        """Return the rows of the last epoch."""
        self._tell_before(np.inf)
        return self._frame(np.inf)

    def said_also(self) -> list[dict[str, Any]]:
        """Return the rows of the other table since the last call, of epochs that are over."""
        found, self._over = self._over, []
        return found

    def counts(self) -> dict[str, Any]:
        """Return what became of the plots."""
        outcomes = dict(sorted(self._pool.outcomes.items()))
        return {
            "aircraft_waiting": self._roster.waiting,
            "plots_taken": outcomes.pop(TAKEN, 0),
            "plots_refused": outcomes,
            "restarts": self._pool.restarts,
        }

    def _follow(self, order: Order) -> None:
        if isinstance(order, Sampled):
            self._sample(order)
            return
        track_id = order.track_id
        if not isinstance(order, Take):
            self._tell(track_id)
            self._pool.let_go(track_id)
            return
        epochs = np.floor(order.plots["time_s"] / self._epoch_s).astype(np.int64).tolist()
        for plot, epoch in zip(order.plots, epochs, strict=True):
            if self._last.get(track_id, (epoch,))[0] < epoch:
                self._tell(track_id)
            self._pool.take(track_id, plot, order.published)
            self._last[track_id] = epoch, float(plot["time_s"])

    # What a bundle says at the end of an epoch rests on what was learnt until then.
    def _sample(self, sampled: Sampled) -> None:
        self._tell_before(sampled.epoch)
        self._pool.sample(sampled)
        self._tell_before(sampled.epoch + 1)

    def _tell_before(self, epoch: float) -> None:
        for track_id in [one for one, (last, _) in self._last.items() if last < epoch]:
            self._tell(track_id)

    # What the bundle says at the end of an epoch of its track, if it took a plot in it.
    def _tell(self, track_id: int) -> None:
        told = self._last.pop(track_id, None)
        reading = self._pool.read(track_id)
        if told is None or reading is None:
            return
        epoch, time_s = told
        if self._also is not None:
            self._said.append((epoch, track_id, self._also(track_id, reading, self.plane)))
        try:
            document = trajectories_of(track_id, reading, self.plane, PATH_POINTS_DEFAULT, STEP_S)
            row = table_row(document)
        except TrajectoryError as error:
            row = {"track_id": track_id, "time_s": time_s, "reason": error.code}
        self._rows.append((epoch, track_id, row))

    def _frame(self, epoch: float) -> pl.DataFrame:
        done = sorted((row for row in self._rows if row[0] < epoch), key=lambda row: row[:2])
        self._rows = [row for row in self._rows if row[0] >= epoch]
        over = sorted((one for one in self._said if one[0] < epoch), key=lambda one: one[:2])
        self._said = [one for one in self._said if one[0] >= epoch]
        self._over += [row for _, _, rows in over for row in rows]
        whole = [{name: row.get(name) for name in TRAJECTORY_SCHEMA} for _, _, row in done]
        return pl.DataFrame(whole, schema=TRAJECTORY_SCHEMA)


def table_row(document: dict[str, Any]) -> dict[str, Any]:
    """Return what a bundle says as a row of `trajectories.parquet`.

    Parameters
    ----------
    document : dict
        What `trajectories_of` gives.

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
