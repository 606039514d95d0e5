"""The read side of the running service."""

from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.runtime.live.live_diagnosis import LiveDiagnosis
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.reject_board import RejectBoard
from multiradar.runtime.queries.registry import History, Query
from multiradar.runtime.stream.events import Subscription
from multiradar.runtime.stream.output_events import OutputEvents

Counts = Callable[[], dict[str, Any]]


class LiveView:
    """What can be read of the running service, from any thread.

    Parameters
    ----------
    known : Knowledge
        Tracks, biases and sensors.
    events : OutputEvents
        The stream of events.
    refusals : RejectBoard
        What was rejected, by reason.
    diagnosis : LiveDiagnosis
        What is probably wrong with a sensor.
    """

    def __init__(
        self, known: Knowledge, events: OutputEvents, refusals: RejectBoard,
        diagnosis: LiveDiagnosis,
    ) -> None:  # fmt: skip
        self._known = known
        self._events = events
        self._refusals = refusals
        self._diagnosis = diagnosis
        #: Counts of the service itself, and of its edges, by the name in the status.
        self.service_counts: Counts = dict
        self.edge_counts: dict[str, Counts] = {}

    @property
    def page_rows_max(self) -> int:
        """Rows of one page of a history; who pages bounds the pages, or rows would go unseen."""
        return self._known.limits.page_rows_max

    def tracks(self) -> pl.DataFrame:
        """Return the live tracks by ascending identifier: `tracks.parquet` and `age_s`."""
        return self._known.tracks()

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return a live track as one row of `tracks`, or None."""
        return self._known.track(track_id)

    def live_ids(self) -> NDArray[np.int64]:
        """Return the identifiers of the live tracks, ascending."""
        return np.ascontiguousarray(self._known.live_rows()[0]["track_id"])

    def ask(self, query: Query, track_id: int | None = None, **given: Any) -> dict[str, Any] | None:
        """Return the answer to a query; see `Query.ask`."""
        return query.ask(self._known, track_id, given)

    def rows(
        self, history: History, subject: int | str, since_s: float | None, limit: int
    ) -> pl.DataFrame:
        """Return rows of a track or a sensor, oldest first.

        Parameters
        ----------
        history : History
            Which table.
        subject : int or str
            The track, live or ended, or the sensor.
        since_s : float or None
            A data time: the first rows from then on. None: the last rows.
        limit : int
            Number of rows at most: fewer mean that there are no more.
        """
        return history.read(self._known, subject, since_s, limit)

    def sensors(self) -> list[dict[str, Any]]:
        """Return the sensors by identifier, with their number of updates and the time of the last.

        Returns
        -------
        list of dict
            `id`, `kind` (radar, position or bearing), site, standard deviations, `updates`,
            `last_update_s`, `age_s`, `health` (a row of `health.parquet`; radars have one from the
            end of the first epoch on), `biases` (the latest row of `biases.parquet` of each
            parameter; none before the first epoch ended), `diagnoses`. What it has not is None.
        """
        records = self._known.sensor_records()
        for record in records:
            record["diagnoses"] = self._diagnosis.of(record["id"])
        return records

    def status(self) -> dict[str, Any]:
        """Return counts, sequences, data time, alarms, hash of the output and version."""
        ring = self._events.ring
        return {
            **self.service_counts(),
            **self._known.counts(),
            "event_sequence": ring.head,
            "subscribers": ring.subscriber_count,
            "rejected_by_code": self._refusals.counts,
            "duplicates_by_sensor": self._refusals.duplicates_by_sensor,
            "diagnoses": self._diagnosis.records(),
            **{name: counts() for name, counts in self.edge_counts.items()},
        }

    def subscribe(self, after: int | None, depth: int) -> Subscription:
        """Enter the stream of events.

        Parameters
        ----------
        after : int or None
            The last event that the reader has; None: from now on.
        depth : int
            A reader that lies farther behind gets a gap notice instead of the oldest events.
        """
        return self._events.ring.subscribe(after, depth)
