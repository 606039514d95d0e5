"""A filter updated one measurement at a time, for research: the kernels of the service."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import (
    ConfigurationError,
    ShapeError,
    TimeOrderError,
    UnknownAircraftError,
)
from multiradar.estimation.array_checks import finite_array, is_integer, require_shape
from multiradar.estimation.filters.bank import Outcome
from multiradar.estimation.gaussian import require_covariance
from multiradar.research.sequential._kernels import walk
from multiradar.research.sequential._player_kernels import play_rows, write_record
from multiradar.research.sequential.arrangement import Options, arrange, initiate
from multiradar.research.sequential.player import empty_record
from multiradar.research.sequential.plots import Form, Plots, Starts, filter_rows
from multiradar.research.sequential.sensors import Sensors

Floats = NDArray[np.float64]

#: The longest bias walk, s: a year, after which no prior information is left.
WALK_MAX_S = 366.0 * 86_400.0

_PLAIN = Options()


class SequentialFilter:
    """One of the registered filters, updated one measurement at a time.

    Parameters
    ----------
    name : str
        `joint`, `two-stage`, `blom`, `blom-macro` or `ci`.
    sensors : Sensors
        From `flat_radars` or `earth_sensors`, with the prior of the biases.
    form : {"polar", "linearised"}
        Treatment of plots of flat radars: polar, or converted to positions, (1.11).
    options : Options
        Process noise and gates; by default neither.
    aircraft_max : int
        Maximum number of simultaneous aircraft.

    Raises
    ------
    UnknownFilterError
        If there is no filter of that name.
    ConfigurationError
        If the form is unknown, or the number of aircraft is below 1 or exceeds
        `multiradar.research.sequential.arrangement.ARRAYS_BYTES_MAX`.

    Notes
    -----
    Every measurement updates the biases of all sensors. With the macro-filter one call of
    `observe_together` is one measurement.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.28) to (1.38), (1.43) to (1.45); Friedland, "Treatment
    of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, for the two-stage filter.

    Examples
    --------
    >>> import numpy as np
    >>> from multiradar.research.sequential.sensors import BiasPrior, flat_radars
    >>> prior = BiasPrior(np.zeros(4), np.diag([500.0, 0.005] * 2) ** 2)
    >>> radars = flat_radars([[0.0, 0.0], [50e3, 0.0]], 15.0, 1e-3, prior)
    >>> one = SequentialFilter("two-stage", radars)
    >>> one.start(7, 0.0, [20e3, 30e3, 100.0, 0.0], np.diag([1e3, 1e3, 50.0, 50.0]) ** 2)
    >>> one.observe(7, 1.0, 0, [36_100.0, 0.59]).name
    'UPDATED'
    >>> round(float(one.biases()[0][0]), 2)  # Range offset of the first radar, m.
    -2.21
    """

    def __init__(
        self,
        name: str,
        sensors: Sensors,
        *,
        form: Form = "polar",
        options: Options = _PLAIN,
        aircraft_max: int = 64,
    ) -> None:
        if not is_integer(aircraft_max) or aircraft_max < 1:
            raise ConfigurationError(
                f"aircraft_max: expected an integer of 1 or more, was {aircraft_max!r}"
            )
        self._sensors, self._form = sensors, form
        no_aircraft = Starts(np.zeros(0), np.zeros((0, 4)), np.zeros((0, 4, 4)))
        filter_rows(_plots([], 0.0, [], np.zeros((0, 2)), None), sensors, no_aircraft, form)
        rows = max(len(sensors), 1)
        self._one = arrange(name, sensors, options, slots=aircraft_max, rows=rows)
        self._slots: dict[int, int] = {}
        self._free = list(range(aircraft_max - 1, -1, -1))
        self._record = empty_record(1, aircraft_max, len(sensors.prior.mean))

    def start(self, aircraft: int, time_s: float, mean: ArrayLike, covariance: ArrayLike) -> None:
        """Initiate an aircraft, or reinitialise a known one.

        Parameters
        ----------
        aircraft : int
            Any number.
        time_s : float
            Time of the state, s.
        mean : (4,) array_like
            East, north (m) and their rates (m/s).
        covariance : (4, 4) array_like
            Covariance of its error.

        Raises
        ------
        ShapeError
            If the state or the covariance has another shape, or is not finite.
        CovarianceError
            If the covariance is not symmetric or not positive definite.
        ConfigurationError
            If the maximum number of aircraft is reached.

        Notes
        -----
        Where a time offset is estimated, it is linearised once, at one velocity. The given
        velocity is used when the variances of both rates sum to less than (30 m/s)². Otherwise
        the aircraft is reinitialised once its plots have determined the velocity, without the
        given state.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.24): the block of one aircraft, with zeros between it
        and all others.
        """
        state = finite_array(mean, "aircraft state", (4,))
        matrix = require_shape(covariance, "aircraft covariance", (4, 4))
        require_covariance(matrix, "aircraft covariance")
        time_s = float(finite_array(time_s, "start time", ()))
        slot = self._slot(aircraft)
        self._assign_slot(aircraft, slot)
        initiate(self._one, slot, time_s, state, matrix)

    def observe(
        self,
        aircraft: int,
        time_s: float,
        sensor: int,
        value: ArrayLike,
        height_m: float = math.nan,
    ) -> Outcome:
        """Update with one measurement; an unknown aircraft is initiated by it.

        Parameters
        ----------
        aircraft, sensor : int
            Measured aircraft and measuring sensor (counted from 0).
        time_s : float
            Not before the last time of this aircraft.
        value : (2,) array_like
            Range (m) and azimuth (rad), or east and north (m).
        height_m : float
            Height of the aircraft above the ellipsoid, which radars on WGS 84 need; NaN if
            unknown.

        Returns
        -------
        Outcome
            Outcome. An aircraft whose first plot does not initiate it stays unknown.

        Raises
        ------
        TimeOrderError
            If the time is earlier than the last one.
        ShapeError
            If the value is not two numbers, the sensor does not exist, or the height is missing.
        ConfigurationError
            If the maximum number of aircraft is reached.

        References
        ----------
        IMM UrO RAN report (2016), equations (1.28) to (1.38) and (1.43) to (1.45); Friedland, B.,
        "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, for the two-stage
        filter.
        """
        values = require_shape(value, "plot value", (2,))
        return self.observe_together(aircraft, time_s, [sensor], values[None, :], [height_m])[0]

    def observe_together(
        self,
        aircraft: int,
        time_s: float,
        sensors: Sequence[int],
        values: ArrayLike,
        height_m: ArrayLike | None = None,
    ) -> tuple[Outcome, ...]:
        """Update with simultaneous measurements of one aircraft by different sensors.

        Parameters
        ----------
        aircraft : int
            Measured aircraft.
        time_s : float
            Not before the last time of this aircraft.
        sensors : sequence of int
            Measuring sensors.
        values : (n, 2) array_like
            Value of each measurement.
        height_m : (n,) array_like, optional
            Heights above the ellipsoid, which radars on WGS 84 need; NaN if unknown.

        Returns
        -------
        tuple of Outcome
            Outcome of each.

        Raises
        ------
        TimeOrderError
            If the time is earlier than the last one.
        ShapeError
            If the values are not pairs of numbers, one per sensor, a sensor is repeated or does not
            exist, or a height is missing.
        ConfigurationError
            If the maximum number of aircraft is reached.

        References
        ----------
        IMM UrO RAN report (2016), section 1.4, the macro-filter, whose measurement it is; for the
        others as `observe`, (1.28) to (1.45).
        """
        slot = self._slot(aircraft)
        plots = _plots([slot], time_s, sensors, values, height_m)
        one = self._one
        arrays = one.aircraft
        known = arrays.time[slot] if not np.isnan(arrays.time[slot]) else -np.inf
        if time_s < known:
            raise TimeOrderError(f"plot of aircraft {aircraft}", time_s, float(known))
        count = len(arrays.time)
        starts = Starts(
            np.full(count, time_s), np.zeros((count, 4)), np.tile(np.eye(4), (count, 1, 1))
        )
        rows = filter_rows(plots, self._sensors, starts, self._form)
        # The bias walk starts at this very time: biases drift with `walk` only.
        play_rows(
            one.definition.method, time_s, 1.0, np.array([time_s]), one.work, rows, one.model,
            arrays, one.result, one.store, self._record,
        )  # fmt: skip
        if not np.isnan(arrays.time[slot]):
            self._assign_slot(aircraft, slot)
        return tuple(Outcome(int(number)) for number in one.result.outcome[: len(plots)])

    def walk(self, duration_s: float) -> None:
        """Advance the random walk of the biases, with the drift of their prior.

        Parameters
        ----------
        duration_s : float
            Duration, s.

        Raises
        ------
        TimeOrderError
            If it is negative or not finite.
        ConfigurationError
            If it is longer than `WALK_MAX_S`.
        ShapeError
            If it is not a number.

        References
        ----------
        IMM UrO RAN report (2016), equations (1.6) and (1.25) for ς. The re-anchoring of the
        two-stage filter is the project's own: see `multiradar.estimation.bias.store.drift`.
        """
        duration_s = float(require_shape(duration_s, "duration of the random walk", ()))
        if not 0.0 <= duration_s < np.inf:
            raise TimeOrderError("end of the random walk", duration_s, 0.0)
        if duration_s > WALK_MAX_S:
            raise ConfigurationError(
                f"duration of the random walk: expected at most {WALK_MAX_S:g} s, was "
                f"{duration_s:g} s"
            )
        one = self._one
        walk(one.definition.method, duration_s, one.model, one.aircraft, one.store)

    def end(self, aircraft: int) -> None:
        """Drop an aircraft; its contribution to the bias estimate stays.

        Parameters
        ----------
        aircraft : int
            Its number.

        Raises
        ------
        UnknownAircraftError
            If there is no such aircraft.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.8) without χ_i: its block and its row leave (1.24),
        the block of ς stays.
        """
        slot = self._known(aircraft)
        del self._slots[aircraft]
        self._one.aircraft.time[slot] = np.nan
        self._free.append(slot)

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        """Return state (4,) and covariance (4, 4) of an aircraft at its last time, biases included.

        Parameters
        ----------
        aircraft : int
            Its number.

        Returns
        -------
        state : (4,) float64
            East, north (m) and their rates (m/s).
        covariance : (4, 4) float64
            Of its error.

        Raises
        ------
        UnknownAircraftError
            If there is no such aircraft.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.30): χ̄ and P̄; Friedland, B., "Treatment of bias in
        recursive filtering", IEEE TAC 14 (1969), 359-367, for the part of the biases.
        """
        slot, one = self._known(aircraft), self._one
        record = self._record
        write_record(0, float(one.aircraft.time[slot]), one.model, one.aircraft, record)
        return record.mean[0, slot].copy(), record.covariance[0, slot].copy()

    def biases(self) -> tuple[Floats, Floats]:
        """Return the estimates of the biases, (c,), and their covariance, (c, c).

        Returns
        -------
        estimate : (c,) float64
            In the order of the prior (m, rad, 1 or s by kind).
        covariance : (c, c) float64
            Of its errors.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.32): ς̂ and P̂_ςς.
        """
        model = self._one.model
        return model.bias.copy(), model.bias_covariance.copy()

    # The slot of an aircraft, or the next free one, which is assigned when the aircraft starts.
    def _slot(self, aircraft: int) -> int:
        if not is_integer(aircraft):
            raise ShapeError("aircraft number", "an integer", (), repr(aircraft))
        if aircraft in self._slots:
            return self._slots[aircraft]
        if not self._free:
            count = len(self._slots)
            raise ConfigurationError(f"aircraft: expected at most {count}, found more")
        return self._free[-1]

    def _assign_slot(self, aircraft: int, slot: int) -> None:
        if aircraft not in self._slots:
            self._free.remove(slot)
            self._slots[aircraft] = slot

    def _known(self, aircraft: int) -> int:
        if not is_integer(aircraft) or aircraft not in self._slots:
            raise UnknownAircraftError(aircraft)
        return self._slots[aircraft]


def _plots(
    slots: list[int],
    time_s: float,
    sensors: Sequence[int],
    values: ArrayLike,
    height_m: ArrayLike | None,
) -> Plots:
    if np.ndim(sensors) != 1:
        raise ShapeError("plot sensors", "one dimension", np.shape(sensors))
    count = len(sensors)
    time = float(finite_array(time_s, "plot time", ()))
    # Plots rejects non-integers; an empty list has no integer type by itself.
    seeing = sensors if count else np.zeros(0, np.int64)
    return Plots(np.full(count, time), np.array(slots * count, np.int64), seeing, values, height_m)
