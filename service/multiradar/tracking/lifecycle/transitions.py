"""Codes of lifecycle transitions and of their reasons, with names.

Compiled functions use the codes; the names are used on the wire.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.columns import joined_columns

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Transitions.
STARTED = 0
CONFIRMED = 1
COASTING = 2
RESUMED = 3
RESTARTED = 4
ENDED = 5

#: Names of the transitions on the wire, by number.
TRANSITION_NAMES = ("started", "confirmed", "coasting", "resumed", "restarted", "ended")

# Reasons.
NEW_IDENTITY = 0
NEW_PLACE = 1
UPDATES = 2
LIKELIHOOD = 3
SILENT = 4
HEARD = 5
REJECTED = 6
UNCONFIRMED = 7
UNLIKELY = 8
MERGED = 9

#: Names of the reasons on the wire, by number.
REASON_NAMES = (
    "new-identity",
    "new-place",
    "updates",
    "likelihood",
    "silent",
    "heard",
    "refused",
    "unconfirmed",
    "unlikely",
    "merged",
)

#: In place of a track identifier: none.
NO_TRACK = -1


class TerminatedTracks(NamedTuple):
    """Tracks terminated at one time, before their slots are reused.

    Attributes
    ----------
    slot, track_id : (n,) int64
        Slots and identifiers of the tracks.
    updated_s : (n,) float64
        Data time of the last update of each.
    reason : (n,) int64
        Reasons.
    into : (n,) int64
        Track into which each is merged, `NO_TRACK` for none.
    """

    slot: Integers
    track_id: Integers
    updated_s: Floats
    reason: Integers
    into: Integers

    @classmethod
    def empty(cls) -> Self:
        """Return no tracks."""
        none = np.empty(0, np.int64)
        return cls(none, none, np.empty(0), none, none)

    def and_also(self, others: "TerminatedTracks") -> "TerminatedTracks":
        """Return these and others, by ascending identifier."""
        order = np.argsort(np.concatenate([self.track_id, others.track_id]))
        return TerminatedTracks(
            slot=np.concatenate([self.slot, others.slot])[order],
            track_id=np.concatenate([self.track_id, others.track_id])[order],
            updated_s=np.concatenate([self.updated_s, others.updated_s])[order],
            reason=np.concatenate([self.reason, others.reason])[order],
            into=np.concatenate([self.into, others.into])[order],
        )


@dataclass(frozen=True, slots=True)
class TrackTransitions:
    """One row for each lifecycle transition of a track, in the order of the measurements.

    Attributes
    ----------
    time_s : (n,) float64
        Data time at which it was detected: of a measurement, or of the start of an epoch or window;
        never decreasing.
    track_id : (n,) int64
        The track.
    transition, reason : (n,) int8
        Transition and reason, indices into `TRANSITION_NAMES` and `REASON_NAMES`.
    into_track_id : (n,) int64
        Track into which it was merged, −1 for none.
    last_update_s : (n,) float64
        Data time of the previous update of the track, NaN for none.
    """

    time_s: NDArray[np.float64]
    track_id: NDArray[np.int64]
    transition: NDArray[np.int8]
    reason: NDArray[np.int8]
    into_track_id: NDArray[np.int64]
    last_update_s: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.track_id)

    @classmethod
    def concatenate(cls, parts: "Sequence[TrackTransitions]") -> "TrackTransitions":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))
