"""Numbers of tracks: initiated, confirmed, terminated."""

import numpy as np

from multiradar.tracking.lifecycle.transitions import CONFIRMED
from multiradar.tracking.outputs import EngineOutput


class TrackTally:
    """Counts the tracks in the output of an engine.

    A track that was confirmed once counts as confirmed, even if it is tentative again after it was
    reinitialised.
    """

    def __init__(self) -> None:
        self._initiated = 0
        self._ended = 0
        self._confirmed_ended = 0
        # Only live tracks are kept, so that memory is bounded.
        self._confirmed_live: set[int] = set()

    def update(self, output: EngineOutput) -> None:
        """Count the tracks of one call of the engine."""
        if len(output.updates):
            # Tracks are numbered from 1 without gaps by first appearance.
            self._initiated = max(self._initiated, int(output.updates.track_id.max()))
        steps = output.transitions
        confirmed = steps.track_id[np.equal(steps.transition, CONFIRMED)]
        self._confirmed_live.update(confirmed.tolist())
        ended = self._confirmed_live.intersection(output.ended.track_id.tolist())
        self._confirmed_live -= ended
        self._confirmed_ended += len(ended)
        self._ended += len(output.ended)

    @property
    def initiated(self) -> int:
        """Number of tracks so far, tentative ones included."""
        return self._initiated

    @property
    def confirmed(self) -> int:
        """Number of tracks confirmed so far."""
        return self._confirmed_ended + len(self._confirmed_live)

    def counts(self) -> dict[str, int]:
        """Return the counts under the names of `/v1/status`."""
        return {
            "tracks_initiated": self._initiated,
            "tracks_confirmed": self.confirmed,
            "tracks_confirmed_live": len(self._confirmed_live),
            "tracks_ended": self._ended,
        }
