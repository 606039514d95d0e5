"""States of confirmed tracks at past times: what forecasts and encounters of then are made from."""

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import StateError
from multiradar.storage.snapshots import joined_rows
from multiradar.tracking.mode_states import ModeStates
from multiradar.tracking.outputs import StateSample, TrackStates

_Array = NDArray[Any]

# Fields of rows: the time of the sample, those of the states, and of their modes.
_SAMPLE = "sample_s"
_FIELDS = ("track_id", "time_s", "mean", "covariance", "height_m", "shared", "climbs")
_MODE_FIELDS = ("modes_probability", "modes_mean", "modes_covariance")


class _Kept(NamedTuple):
    # A sample, its size, and the number of its first state.
    time_s: float
    states: TrackStates
    size: int
    first: int


class StateBoard:
    """The samples of the last time, in single precision; one owner.

    Parameters
    ----------
    bytes_max : int
        Memory of the samples; the oldest are discarded first.
    """

    def __init__(self, bytes_max: int) -> None:
        self._bytes_max = bytes_max
        self._kept: deque[_Kept] = deque()
        self._size = 0
        self._appended = 0

    @property
    def appended(self) -> int:
        """States appended so far."""
        return self._appended

    @property
    def capacity(self) -> int:
        """States that are retained."""
        return self._appended - self._kept[0].first if self._kept else 0

    def rows(self, first: int, end: int) -> NDArray[np.void]:
        """Return the states first…end as rows; see `RowLog.rows`."""
        # A copy: the owner may append meanwhile.
        parts = [
            _rows_of(kept)[max(first - kept.first, 0) : max(end - kept.first, 0)]
            for kept in tuple(self._kept)
            if kept.first < end and first < kept.first + len(kept.states)
        ]
        if sum(map(len, parts)) != end - first:
            raise StateError(f"state {first} of {self._appended} is no longer retained")
        return joined_rows(parts) if parts else np.empty(0, [(_SAMPLE, np.float64)])

    def refill(self, first: int, rows: NDArray[np.void]) -> None:
        """Replace the content; see `RowLog.refill`."""
        self._kept.clear()
        self._size, self._appended = 0, first
        cuts = np.flatnonzero(np.diff(rows[_SAMPLE])) + 1
        for sample in np.split(rows, cuts) if len(rows) else ():
            self._keep(float(sample[_SAMPLE][0]), _states_of(sample))

    def append(self, samples: Sequence[StateSample]) -> None:
        """Add samples, in order of time."""
        for sample in samples:
            self._keep(sample.time_s, _in_precision(sample.states, np.float32))
        while self._kept and self._size > self._bytes_max:
            self._size -= self._kept.popleft().size

    def at(self, after_s: float, until_s: float) -> TrackStates | None:
        """Return the last state of each track in the samples of a span; None without any.

        Parameters
        ----------
        after_s, until_s : float
            Samples later than the first and not later than the second, s.

        Returns
        -------
        TrackStates or None
            By ascending track, in double precision.
        """
        parts: list[TrackStates] = []
        known = np.empty(0, np.int64)
        # A copy: the owner may append meanwhile.
        for kept in reversed(tuple(self._kept)):
            if not after_s < kept.time_s <= until_s:
                continue
            new = np.flatnonzero(~np.isin(kept.states.track_id, known))
            if len(new):
                parts.append(kept.states.at(new))
                known = np.concatenate([known, parts[-1].track_id])
        if not parts:
            return None
        found = _joined(parts)
        return _in_precision(found.at(np.argsort(found.track_id)), np.float64)

    def _keep(self, time_s: float, states: TrackStates) -> None:
        size = sum(values.nbytes for values in _arrays(states))
        self._kept.append(_Kept(time_s, states, size, self._appended))
        self._size += size
        self._appended += len(states)


# A sample as rows: fields of the states, and of their modes.
def _rows_of(kept: _Kept) -> NDArray[np.void]:
    states = kept.states
    columns: dict[str, _Array | None] = {_SAMPLE: np.full(len(states), kept.time_s)}
    columns |= {name: getattr(states, name) for name in _FIELDS}
    columns |= {name: getattr(states.modes, name[6:], None) for name in _MODE_FIELDS}
    given = {name: values for name, values in columns.items() if values is not None}
    kind = [(name, values.dtype, values.shape[1:]) for name, values in given.items()]
    rows = np.empty(len(states), kind)
    for name, values in given.items():
        rows[name] = values
    return rows


def _states_of(rows: NDArray[np.void]) -> TrackStates:
    names = rows.dtype.names or ()
    found = {name: np.array(rows[name], order="C") for name in names}
    modes = None
    if _MODE_FIELDS[0] in found:
        modes = ModeStates(*(found[name] for name in _MODE_FIELDS))
    return TrackStates(**{name: found.get(name) for name in _FIELDS}, modes=modes)  # type: ignore[arg-type]


def _arrays(states: TrackStates) -> Iterator[_Array]:
    modes = states.modes
    of_modes = () if modes is None else (modes.probability, modes.mean, modes.covariance)
    for values in (states.mean, states.covariance, states.shared, states.climbs, *of_modes):
        if values is not None:
            yield values


# Times keep their precision.
def _in_precision(states: TrackStates, kind: type[np.floating[Any]]) -> TrackStates:
    modes = states.modes
    if modes is not None:
        modes = ModeStates(
            modes.probability.astype(kind), modes.mean.astype(kind), modes.covariance.astype(kind)
        )
    return TrackStates(
        states.track_id, states.time_s, states.mean.astype(kind), states.covariance.astype(kind),
        states.height_m.astype(kind), modes,
        None if states.shared is None else states.shared.astype(kind),
        None if states.climbs is None else states.climbs.astype(kind),
    )  # fmt: skip


# All are of one filter, which has modes, shared errors and climbs in all of its states or in none.
def _joined(parts: Sequence[TrackStates]) -> TrackStates:
    modes = [part.modes for part in parts if part.modes is not None]
    shared = [part.shared for part in parts if part.shared is not None]
    climbs = [part.climbs for part in parts if part.climbs is not None]
    return TrackStates(
        np.concatenate([part.track_id for part in parts]),
        np.concatenate([part.time_s for part in parts]),
        np.concatenate([part.mean for part in parts]),
        np.concatenate([part.covariance for part in parts]),
        np.concatenate([part.height_m for part in parts]),
        _joined_modes(modes) if modes else None,
        _joined_columns(shared) if shared else None,
        np.concatenate(climbs) if climbs else None,
    )


# The columns of a sensor that was added are zero in the states before.
def _joined_columns(parts: Sequence[_Array]) -> _Array:
    most = max(part.shape[2] for part in parts)
    wide = [np.pad(part, ((0, 0), (0, 0), (0, most - part.shape[2]))) for part in parts]
    return np.concatenate(wide)


def _joined_modes(parts: Sequence[ModeStates]) -> ModeStates:
    return ModeStates(
        np.concatenate([part.probability for part in parts]),
        np.concatenate([part.mean for part in parts]),
        np.concatenate([part.covariance for part in parts]),
    )
