"""Numbers of tracks: initiated, confirmed, terminated."""

from typing import ClassVar

import numpy as np

from multiradar.state import Fields
from multiradar.tracking.lifecycle.transitions import (
    CONFIRMED,
    ENDED,
    MERGED,
    STARTED,
    UNCONFIRMED,
)
from multiradar.tracking.outputs import EngineOutput

#: Names of the counted transitions.
_COUNTED = ("started", "confirmed", "ended_unconfirmed", "ended_silent", "merged")


class TrackTally:
    """Counts the tracks in the output of an engine, as `transitions.parquet` lists them.

    A track that was confirmed once counts as confirmed, even if it is tentative again after it was
    reinitialised.
    """

    STATE: ClassVar[Fields] = {
        "_counts": dict[str, int],
        "_confirmed_ended": int,
        "_confirmed_live": set[int],
    }

    def __init__(self) -> None:
        self._counts = dict.fromkeys(_COUNTED, 0)
        self._confirmed_ended = 0
        # Only live tracks are kept, so that memory is bounded.
        self._confirmed_live: set[int] = set()

    def update(self, output: EngineOutput) -> None:
        """Count the tracks of one call of the engine."""
        # Identifiers have gaps: a plot that cannot be located takes one without a track.
        steps = output.transitions
        over = np.equal(steps.transition, ENDED)
        merged, never = np.equal(steps.reason, MERGED), np.equal(steps.reason, UNCONFIRMED)
        confirmed = np.equal(steps.transition, CONFIRMED)
        found = (
            np.equal(steps.transition, STARTED), confirmed, over & never, over & ~never & ~merged,
            over & merged,
        )  # fmt: skip
        for name, rows in zip(_COUNTED, found, strict=True):
            self._counts[name] += int(np.count_nonzero(rows))
        self._confirmed_live.update(steps.track_id[confirmed].tolist())
        ended = self._confirmed_live.intersection(steps.track_id[over].tolist())
        self._confirmed_live -= ended
        self._confirmed_ended += len(ended)

    @property
    def initiated(self) -> int:
        """Number of tracks so far, tentative ones included."""
        return self._counts["started"]

    @property
    def confirmed(self) -> int:
        """Number of tracks confirmed so far."""
        return self._confirmed_ended + len(self._confirmed_live)

    @property
    def transitions(self) -> dict[str, int]:
        """Number of transitions so far, by name.

        `ended_silent` includes tracks terminated by their score.
        """
        return dict(self._counts)

    def counts(self) -> dict[str, int]:
        """Return the counts under the names of `/v1/status`."""
        return {
            "tracks_initiated": self.initiated,
            "tracks_confirmed": self.confirmed,
            "tracks_confirmed_live": len(self._confirmed_live),
            "tracks_ended": sum(self._counts[name] for name in _COUNTED[2:]),
        }
