"""Steps in the lives of tracks as rows of a table, for the ring that keeps the last of them."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.outputs import TrackTransitions

#: A row of `TrackTransitions`; field names are the same.
TRANSITION_DTYPE = np.dtype(
    [
        ("time_s", np.float64),
        ("track_id", np.int64),
        ("transition", np.int8),
        ("reason", np.int8),
        ("into_track_id", np.int64),
        ("last_update_s", np.float64),
    ]
)


def transition_rows(transitions: TrackTransitions) -> NDArray[np.void]:
    """Return transitions as rows of `TRANSITION_DTYPE`."""
    rows = np.empty(len(transitions), TRANSITION_DTYPE)
    for field in fields(transitions):
        rows[field.name] = getattr(transitions, field.name)
    return rows


def row_transitions(rows: NDArray[np.void]) -> TrackTransitions:
    """Return rows of `TRANSITION_DTYPE` as transitions, a copy."""
    names = [field.name for field in fields(TrackTransitions)]
    return TrackTransitions(**{name: np.ascontiguousarray(rows[name]) for name in names})
