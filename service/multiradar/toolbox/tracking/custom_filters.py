"""Filters of one aircraft written in Python: registered by name, run in place of the compiled ones.

The compiled host filter associates plots with tracks, initiates and drops tracks and estimates the
biases; the registered filter estimates the motion of each aircraft from its plots. So two
registered filters see the same plots of the same aircraft.
"""

from collections.abc import Callable, Sized
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ArgumentError, CovarianceError, ShapeError, UnknownFilterError
from multiradar.estimation.array_checks import finite_array
from multiradar.estimation.filters.bank import FILTERS
from multiradar.estimation.gaussian import require_covariance
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.plot_rows import plot_rows
from multiradar.runtime.trajectories.plots import (
    PLOT_DTYPE,
    LocatedPlot,
    PlotLocator,
    prior_biases,
    updated_biases,
)
from multiradar.toolbox.arguments import typed
from multiradar.tracking.outputs import BiasRecords, EngineOutput, TrackUpdates
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class AircraftPlot:
    """A plot of one aircraft on the system plane, corrected for the biases published at its time.

    Attributes
    ----------
    time_s : float
        Data time, s; not before that of the last plot.
    sensor_id : str
        The sensor.
    position_m : (2,) float64
        East and north, m.
    covariance_m2 : (2, 2) float64
        Of its error, with the uncertainty of biases and height, m².
    height_m : float
        Height of the aircraft above the ellipsoid, m; NaN if unknown.
    """

    time_s: float
    sensor_id: str
    position_m: Floats
    covariance_m2: Floats
    height_m: float


class AircraftFilter(Protocol):
    """A filter of one aircraft."""

    def update(self, plot: AircraftPlot) -> tuple[ArrayLike, ArrayLike]:
        """Process the next plot.

        Parameters
        ----------
        plot : AircraftPlot
            The plot; the first one initiates the filter.

        Returns
        -------
        state : (4,) array_like
            East, north (m) and their rates (m/s) at the time of the plot.
        covariance : (4, 4) array_like
            Of its error.
        """
        ...


@dataclass(frozen=True, slots=True)
class CustomFilter:
    """A registered filter.

    Attributes
    ----------
    name : str
        Its name.
    make : callable
        Returns a filter of one aircraft.
    host : str
        The compiled filter for association and biases.
    """

    name: str
    make: Callable[[], AircraftFilter]
    host: str

    def start(
        self, sensors: SensorTable, settings: TrackingSettings
    ) -> Callable[[EngineOutput], EngineOutput]:
        """Return what replaces the states of tracks in the output of the host, output by output."""
        return _Refinement(self, sensors, settings).refine


_REGISTERED: dict[str, CustomFilter] = {}


@typed
def register_filter(name: str, make: Callable[[], AircraftFilter], *, host: str = "imm") -> None:
    """Register a filter of one aircraft, for `track` and `Tracker` by its name.

    Parameters
    ----------
    name : str
        Its name; registering a name again replaces its filter.
    make : callable
        Returns a new `AircraftFilter`, such as its class: called once for each track.
    host : str
        The compiled filter that associates plots with tracks and estimates the biases.

    Raises
    ------
    ArgumentError
        The name is that of a compiled filter, or is empty; or the class has no `update`.
    UnknownFilterError
        There is no such host.

    Notes
    -----
    The filter receives every accepted plot of a track, even before its confirmation. Bearings,
    and plots in the cone of silence, have no position: for these the state is that of the host.
    """
    if not name:
        raise ArgumentError("`name`: expected a name, was an empty string", "name")
    if name in FILTERS:
        raise ArgumentError(f"`name`: filter {name!r} already exists; choose another name", "name")
    if isinstance(make, type) and not callable(getattr(make, "update", None)):
        raise ArgumentError(
            f"`make`: expected a class with a method `update`, was {make.__name__}", "make"
        )
    if host not in FILTERS:
        raise UnknownFilterError(host, list(FILTERS))
    _REGISTERED[name] = CustomFilter(name, make, host)


def host_of(name: str | None) -> tuple[str | None, CustomFilter | None]:
    """Return the compiled filter for a name, and the registered one if it names one.

    Raises
    ------
    UnknownFilterError
        There is no such filter.
    """
    if name is None or name in FILTERS:
        return name, None
    if name not in _REGISTERED:
        raise UnknownFilterError(name, [*FILTERS, *_REGISTERED])
    return _REGISTERED[name].host, _REGISTERED[name]


def _pair(found: object, what: str) -> tuple[ArrayLike, ArrayLike]:
    # The usual mistakes are a missing return and a state without its covariance.
    if isinstance(found, tuple | list) and len(found) == 2:
        return found[0], found[1]
    shape = np.shape(found) if isinstance(found, np.ndarray) else ()
    size = f" of {len(found)}" if isinstance(found, Sized) else ""
    was = "None" if found is None else f"{type(found).__name__}{size}"
    raise ShapeError(f"{what}: update", "a state and a covariance", shape, was)


class _Refinement:
    # The filters of all live tracks of one run, and the biases published so far.
    def __init__(
        self, chosen: CustomFilter, sensors: SensorTable, settings: TrackingSettings
    ) -> None:
        self._chosen, self._sensors = chosen, sensors
        self._locator = PlotLocator(sensors, settings)
        self._published = prior_biases(sensors)
        self._filters: dict[int, AircraftFilter] = {}

    def refine(self, output: EngineOutput) -> EngineOutput:
        """Return an output with the states of the registered filter."""
        updates, records = output.updates, output.biases
        plots = plot_rows(output, PLOT_DTYPE)
        states: list[tuple[int, Floats, Floats]] = []
        applied = 0
        for row in range(len(updates)):
            applied = self._publish(records, applied, float(updates.time_s[row]))
            located = self._locator.locate(plots[row], self._published)
            if isinstance(located, LocatedPlot):
                states.append((row, *self._update(plots[row], located)))
        self._publish(records, applied, np.inf)
        for track in output.ended.track_id.tolist():
            self._filters.pop(track, None)
        return replace(output, updates=self._described(updates, states))

    def _publish(self, records: BiasRecords, applied: int, time_s: float) -> int:
        # Biases of an epoch are published at its end.
        until = int(np.searchsorted(records.time_s, time_s, side="right"))
        if until > applied:
            rows = np.arange(applied, until)
            self._published = updated_biases(self._published, records, rows)
        return max(until, applied)

    def _update(self, plot: np.void, located: LocatedPlot) -> tuple[Floats, Floats]:
        track = int(plot["track_id"])
        if track not in self._filters:
            self._filters[track] = self._chosen.make()
        given = AircraftPlot(
            float(plot["time_s"]),
            self._sensors.ids[int(plot["sensor"])],
            located.position_m.copy(),
            located.covariance_m2.copy(),
            float(plot["track_height_m"]),
        )
        what = f"filter {self._chosen.name}, track {track}"
        found = _pair(self._filters[track].update(given), what)
        state = finite_array(found[0], f"{what}: state", (4,))
        covariance = finite_array(found[1], f"{what}: covariance", (4, 4))
        try:
            require_covariance(covariance, f"{what}: covariance")
        except CovarianceError as error:
            raise CovarianceError(f"{error} at {given.time_s} s") from error
        return state, covariance

    def _described(
        self, updates: TrackUpdates, states: list[tuple[int, Floats, Floats]]
    ) -> TrackUpdates:
        if not states:
            return updates
        plane = self._locator.plane
        rows = np.array([row for row, _, _ in states])
        mean = np.array([state for _, state, _ in states])
        covariance = np.array([one for _, _, one in states])
        height_m = np.nan_to_num(updates.height_m[rows])
        local = plane.local_matrix(mean[:, 0], mean[:, 1], height_m)
        latitude, longitude = plane.to_geodetic(mean[:, 0], mean[:, 1])
        speed, heading = plane.ground_velocity(
            mean[:, 0], mean[:, 1], mean[:, 2], mean[:, 3], height_m
        )

        def sigma(own: slice) -> Floats:
            spread = local @ covariance[:, own, own] @ np.swapaxes(local, 1, 2)
            return np.asarray(np.sqrt(np.trace(spread, axis1=1, axis2=2)))

        found = {
            "latitude_rad": latitude,
            "longitude_rad": longitude,
            "speed_mps": speed,
            "heading_rad": heading,
            "position_sigma_m": sigma(slice(0, 2)),
            "velocity_sigma_mps": sigma(slice(2, 4)),
            # Motion modes are those of the host.
            "turn_right_probability": np.full(len(rows), np.nan),
            "turn_left_probability": np.full(len(rows), np.nan),
            "speed_change_probability": np.full(len(rows), np.nan),
        }
        columns = {name: getattr(updates, name).copy() for name in found}
        for name, values in found.items():
            columns[name][rows] = values
        return replace(updates, **columns)
