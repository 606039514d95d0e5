"""Probabilistic association (JPDA): tracks updated by several plots, weighted by probability.

The filter processes every plot in a copy of the aircraft, and the copies are mixed. This works for
any filter with one state per aircraft, or one per mode. Shared plots are excluded from bias
estimation.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.filters._hypothesis_kernels import (
    copy_aircraft,
    mix_hypotheses,
    read_mixed,
    refer_plots,
)
from multiradar.estimation.filters._kernels import NONE, REJECT_NIS
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work, result_arrays
from multiradar.estimation.filters.bank import FILTERS, FilterDefinition
from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET, SensorTable
from multiradar.tracking.association._sharing_kernels import (
    BEST,
    REJECTIONS_MAX,
    RESOLVED_AZIMUTH,
    RESOLVED_RANGE,
    SHARING_COUNT,
    TIMED,
)
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.settings import BY_PROBABILITY, LIKELIEST_EVENTS, TrackingSettings

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Shares(NamedTuple):
    """Plots shared between tracks in a window.

    Attributes
    ----------
    group : (h,) int64
        Ascending: shares of one track in the plots of one sensor.
    slot : (h,) int64
        The track.
    own : (h,) int64
        Row assigned to it, −1 for none.
    row : (h,) int64
        Row of this share, −1 for a missed detection.
    unresolved : (h,) int64
        Whether the plot is unresolved between this track and another.
    probability : (h,) float64
        Probability; shares of a group sum to one.
    """

    group: Integers
    slot: Integers
    own: Integers
    row: Integers
    unresolved: Integers
    probability: Floats

    @classmethod
    def of(cls, table: Floats) -> "Shares":
        """Return the shares of a table that `share_plots` filled."""
        group, slot, own, row, unresolved = table[:, :5].T.astype(np.int64)
        return cls(group, slot, own, row, unresolved, table[:, 5].copy())


class _Round(NamedTuple):
    # One update of each of some aircraft: slots, and rows of their shares.
    slot: Integers
    own: Integers
    time: Floats
    bounds: Integers
    row: Integers
    unresolved: Integers
    probability: Floats


class RowSelection(NamedTuple):
    """Rows processed together.

    Attributes
    ----------
    which : (n,) int64
        Indices of the rows.
    rows : Rows
        The measurements, their slots filled.
    result : Result
        Filled for them.
    """

    which: Integers
    rows: Rows
    result: Result


class SharedPlots:
    """Updates aircraft with shared plots; owned by the engine.

    Parameters
    ----------
    definition : FilterDefinition
        The filter; it must keep one state per aircraft, or one per mode, with its sensitivity to
        the biases.
    sizes : (columns, sensors, modes)
        Numbers of bias parameters, sensors and modes.
    settings : TrackingSettings
        Resolution of the radars.

    Raises
    ------
    ConfigurationError
        If the filter has another form of state.
    """

    def __init__(
        self,
        definition: FilterDefinition,
        sizes: tuple[int, int, int],
        settings: TrackingSettings,
    ) -> None:
        if not definition.keeps_sensitivity:
            able = " or ".join(one.name for one in FILTERS.values() if one.keeps_sensitivity)
            raise ConfigurationError(
                f"filter: expected {able} with probabilistic association, was {definition.name}"
            )
        self._filter, self._sizes = definition, sizes
        self._copies: Aircraft | None = None
        # Variance of an aircraft within an unresolved plot (uniform distribution); none for
        # position reports.
        cell = [settings.range_resolution_m, np.radians(settings.azimuth_resolution_deg), 0.0, 0.0]
        self._cell = np.square(cell) / 12.0

    def update(
        self, shares: Shares, window: RowSelection, model: Model, pool: AircraftPool
    ) -> Integers:
        """Update the aircraft that share plots.

        Parameters
        ----------
        shares : Shares
            The shares.
        window : RowSelection
            Rows of the window; the result is filled for these aircraft, without bias information.
        model : Model
            Model common to all aircraft.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        (m,) int64
            Rows of the other aircraft.
        """
        which, rows, _ = window
        concerned = np.isin(rows.slot[which], shares.slot)
        for one in _rounds(shares, which[concerned], rows):
            self._correct(one, window, model, pool.aircraft)
        return which[~concerned]

    def _correct(self, one: _Round, window: RowSelection, model: Model, aircraft: Aircraft) -> None:
        _, rows, result = window
        count = len(one.row)
        copies = self._room(count)
        copy_aircraft(one.slot, one.bounds, aircraft, copies)
        lengths = np.diff(one.bounds)
        # Missed detection: any row of the track, with a closed gate.
        seen = np.where(one.row == NONE, np.repeat(_any_row(one), lengths), one.row)
        copied = Rows(
            slot=np.arange(count),
            time=np.repeat(one.time, lengths),
            kind=rows.kind[seen],
            sensor=rows.sensor[seen],
            z=rows.z[seen],
            height=rows.height[seen],
            seen=rows.seen[seen],
            ground=rows.ground[seen],
        )
        refer_plots(one.slot, one.bounds, aircraft, model, rows.time[seen], copied)
        found = result_arrays(count, 1, self._sizes[0], keeps_log=False)
        closed = model.options.copy()
        closed[REJECT_NIS] = -1.0
        for kind, known in (
            ((one.row != NONE) & (one.unresolved == 0), model),
            (one.row == NONE, model._replace(options=closed)),
            (one.unresolved != 0, model._replace(noises=model.noises + self._cell)),
        ):
            chosen = np.flatnonzero(kind)
            work = Work(np.zeros(1, np.int64), np.array([0, len(chosen)]), chosen)
            self._filter.step(work, copied, known, copies, found, want_readout=False)
        owners = np.full(len(one.slot), NONE, np.int64)
        alone = (one.row != NONE) & (one.unresolved == 0)
        mine = np.flatnonzero((one.row == np.repeat(one.own, lengths)) & alone)
        owners[np.repeat(np.arange(len(owners)), lengths)[mine]] = mine
        unseen = one.bounds[:-1].copy()
        without = np.flatnonzero(one.row == NONE)
        unseen[np.repeat(np.arange(len(unseen)), lengths)[without]] = without
        mix_hypotheses(
            one.slot, owners, unseen, one.bounds, one.probability, copies, model.bias, aircraft
        )
        together = np.add.reduceat(one.probability * (one.unresolved != 0), one.bounds[:-1])
        # An unresolved plot updates both aircraft.
        kept = (owners == NONE) & (together > 0.5)
        aircraft.updated[one.slot[kept]] = one.time[kept]
        owned = owners != NONE
        result.outcome[one.own[owned]] = found.outcome[owners[owned]]
        # No innovation is recorded: noise statistics exclude shared plots.
        result.innovation[one.own[owned]] = np.nan
        read_mixed(one.slot, one.own, aircraft, model, result)

    def _room(self, count: int) -> Aircraft:
        if self._copies is None or len(self._copies.time) < count:
            self._copies = self._filter.aircraft(1 << (count - 1).bit_length(), *self._sizes)
        return self._copies


def shared_plots(
    settings: TrackingSettings, definition: FilterDefinition, sizes: tuple[int, int, int],
    *, delays: bool = False,
) -> SharedPlots | None:  # fmt: skip
    """Return the updater for shared plots, if the association is probabilistic.

    Parameters
    ----------
    settings : TrackingSettings
        The settings of the tracker.
    definition : FilterDefinition
        The filter.
    sizes : (columns, sensors, modes)
        Numbers of bias parameters, sensors and modes.
    delays : bool
        Whether delays of transponders are estimated.

    Returns
    -------
    SharedPlots or None
        None where every plot belongs to one track.

    Raises
    ------
    ConfigurationError
        If the filter does not support shared plots, or with delays, which hypotheses of different
        plots would not share.
    """
    shares = settings.association == BY_PROBABILITY
    if shares and delays:
        raise ConfigurationError(
            "association: probabilistic does not support transponder_delay_sigma_m; choose "
            "nearest or identity"
        )
    return SharedPlots(definition, sizes, settings) if shares else None


def sharing_rules(sensors: SensorTable, settings: TrackingSettings) -> Floats:
    """Return the sharing rules for `share_plots`.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        The settings of the tracker.

    Returns
    -------
    (SHARING_COUNT,) float64
        By the positions in `_sharing_kernels`.
    """
    rules = np.empty(SHARING_COUNT)
    rules[BEST] = settings.joint_events == LIKELIEST_EVENTS
    rules[TIMED] = np.any(sensors.parameter_kind == PARAMETER_TIME_OFFSET)
    rules[REJECTIONS_MAX] = settings.refusals_max
    rules[RESOLVED_RANGE] = settings.range_resolution_m
    rules[RESOLVED_AZIMUTH] = np.radians(settings.azimuth_resolution_deg)
    return rules


def _any_row(one: _Round) -> Integers:
    # The largest row of each; at least one is a plot.
    return np.maximum.reduceat(one.row, one.bounds[:-1])


def _rounds(shares: Shares, plain: Integers, rows: Rows) -> list[_Round]:
    """Return rounds with at most one update of each aircraft, by ascending time."""
    # Shares of each track and sensor; an unshared row of the track forms a group of its own.
    firsts = np.unique(shares.group)
    plain = plain[~np.isin(plain, shares.own)]
    starts = np.r_[firsts, len(shares.slot) + np.arange(len(plain))]
    slot = np.r_[shares.slot, rows.slot[plain]]
    own = np.r_[shares.own, plain]
    row = np.r_[shares.row, plain]
    unresolved = np.r_[shares.unresolved, np.zeros(len(plain), np.int64)]
    probability = np.r_[shares.probability, np.ones(len(plain))]
    ends = np.r_[starts[1:], len(slot)]
    heaviest = np.array(
        [
            max(range(a, b), key=lambda h: (row[h] != NONE, probability[h], -row[h]))
            for a, b in zip(starts, ends, strict=True)
        ]
    )
    at = np.where(own[starts] == NONE, row[heaviest], own[starts])
    order = np.lexsort((at, rows.time[at], slot[starts]))
    rank = np.zeros(len(order), np.int64)
    for i in range(1, len(order)):
        same = slot[starts[order[i]]] == slot[starts[order[i - 1]]]
        rank[i] = rank[i - 1] + 1 if same else 0
    made = []
    for number in range(int(rank.max()) + 1):
        mine = order[rank == number]
        taken = np.concatenate([np.arange(starts[e], ends[e]) for e in mine])
        made.append(
            _Round(
                slot=slot[starts[mine]],
                own=own[starts[mine]],
                time=rows.time[at[mine]],
                bounds=np.r_[0, np.cumsum(ends[mine] - starts[mine])],
                row=row[taken],
                unresolved=unresolved[taken],
                probability=probability[taken],
            )
        )
    return made
