"""The read side of the running service."""

from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.clock import Clock
from multiradar.runtime.live.live_diagnosis import LiveDiagnosis
from multiradar.runtime.memory.history import DISORDER_S
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.regions.board import RegionBoard
from multiradar.runtime.memory.reject_board import RejectBoard
from multiradar.runtime.picture.air_picture import AirPicture, Asked
from multiradar.runtime.picture.past import PastAsked, PastFiles
from multiradar.runtime.picture.past_knowledge import PastKnowledge
from multiradar.runtime.picture.past_sensors import past_sensors
from multiradar.runtime.picture.past_tracks import not_retained, past_tracks
from multiradar.runtime.picture.sensor_findings import add_findings, confirmed
from multiradar.runtime.queries.aircraft_json import AircraftSnapshots
from multiradar.runtime.queries.registry import History, Query
from multiradar.runtime.stream.events import Subscription
from multiradar.runtime.stream.output_events import OutputEvents

Counts = Callable[[], dict[str, Any]]
#: Returns alarms, and warnings in words.
Alarms = Callable[[], tuple[list[str], list[str]]]

#: Alarm of a neighbouring region that sends no more messages.
REGION_SILENT = "region_silent"
#: Alarms of a sensor with a wrong clock, and of one that delivers more than it can.
CLOCK_ALARM = "clock"
STORM_ALARM = "storm"


class LiveView:
    """The read interface of the running service, for any thread.

    Parameters
    ----------
    known : Knowledge
        Tracks, biases and sensors.
    events : OutputEvents
        The stream of events.
    rejects : RejectBoard
        Rejected rows by code.
    diagnosis : LiveDiagnosis
        Findings about sensors.
    clock : Clock
        Times the states of the air picture.
    """

    def __init__(
        self, known: Knowledge, events: OutputEvents, rejects: RejectBoard,
        diagnosis: LiveDiagnosis, clock: Clock,
    ) -> None:  # fmt: skip
        self._known = known
        self._picture = AirPicture(known, clock)
        self._events = events
        self._rejects = rejects
        self._diagnosis = diagnosis
        self._snapshots = AircraftSnapshots(known)
        #: Alarms of a history on disk and of the interfaces.
        self.further_alarms: list[Alarms] = []
        #: The neighbouring regions; None for a service without.
        self.regions: RegionBoard | None = None
        #: Counters of the service, and of its interfaces by their name in the status.
        self.service_counts: Counts = dict
        self.edge_counts: dict[str, Counts] = {}
        #: Sensors with a wrong clock, and by how much each is ahead, s.
        self.clock_leads: Callable[[], dict[str, float]] = dict
        #: Sensors that deliver more than they can, and what is done about it.
        self.storms: Callable[[], dict[str, str]] = dict

    @property
    def page_rows_max(self) -> int:
        """Maximum rows of one page of a history; larger pages would skip rows."""
        return self._known.limits.page_rows_max

    def keep_history(self, history: PastFiles, alarms: Alarms) -> None:
        """Answer from a history on disk what memory no longer has, with its alarms."""
        self._picture.history = history
        self.further_alarms.append(alarms)

    def tracks(self, at_s: float | None = None) -> pl.DataFrame:
        """Return the live tracks by ascending identifier: `tracks.parquet` and `age_s`.

        Parameters
        ----------
        at_s : float or None
            A past data time; None: the present.

        Raises
        ------
        RequestError
            If nothing is retained of that time.
        """
        if at_s is None:
            return self._marked(self._known.tracks())
        span_s = self._picture.span_s()
        if span_s is None or not span_s[0] <= at_s <= span_s[1]:
            raise not_retained(at_s, span_s)
        source = self._picture.source(at_s)
        return past_tracks(source.tracks(at_s), at_s, source.coast_after_s)

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return a live track as one row of `tracks`, or None."""
        track = self._known.track(track_id)
        if track is None or self.regions is None:
            return track
        return track | self.regions.fields(np.array([track_id])).row(0, named=True)

    def aircraft_json(self) -> bytes:
        """Return the live tracks as `aircraft.json` of readsb."""
        return self._snapshots.aircraft()

    def receiver_json(self) -> dict[str, Any]:
        """Return `receiver.json` of readsb."""
        return self._snapshots.receiver()

    def live_ids(self) -> NDArray[np.int64]:
        """Return the identifiers of the live tracks, ascending."""
        return np.ascontiguousarray(self._known.live_rows()[0]["track_id"])

    def ask(
        self, query: Query, track_id: int | None = None, at_s: float | None = None, /, **given: Any
    ) -> dict[str, Any] | None:
        """Return the answer to a query; see `Query.ask`.

        Parameters
        ----------
        query : Query
            The query.
        track_id : int or None
            The track, if it concerns one.
        at_s : float or None
            A past data time, as far back as it is retained; None: the present.
        **given
            Values of its parameters.
        """
        past = self._picture.retained
        moment = self._known if at_s is None else PastKnowledge(self._known, past, at_s)
        return query.ask(moment, track_id, given)

    def rows(
        self,
        history: History,
        subject: int | str,
        since_s: float | None,
        limit: int,
        until_s: float | None = None,
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
            Maximum number of rows; fewer mean that there are no more.
        until_s : float or None
            A data time: the last rows until then, from `since_s` on.
        """
        known, files = self._known, self._picture.history
        if files is None or (since_s is None and until_s is None):
            return history.read(known, subject, since_s, limit, until_s)
        begin_s = -np.inf if since_s is None else since_s
        # Files from before a track was initiated have none of its rows.
        started_s = None if isinstance(subject, str) else known.past.started_s(subject)
        if started_s is not None:
            begin_s = max(begin_s, started_s - DISORDER_S)
        from_s = known.past.complete_of_s(history.name, subject)
        if begin_s >= from_s:
            return history.read(known, subject, since_s, limit, until_s)
        newer = history.read(known, subject, from_s, limit, until_s)
        if until_s is None:
            older = files.rows(history.name, subject, begin_s, from_s, limit)
            return newer if older.is_empty() else pl.concat([older, newer]).head(limit)
        if len(newer) == limit:
            return newer
        before_s = min(from_s, float(np.nextafter(until_s, np.inf)))
        missing = limit - len(newer)
        older = files.rows(history.name, subject, begin_s, before_s, missing, last=True)
        return newer if older.is_empty() else pl.concat([older, newer])

    def sensors(self, at_s: float | None = None) -> list[dict[str, Any]]:
        """Return the sensors by identifier, with their number of updates and the time of the last.

        Parameters
        ----------
        at_s : float or None
            A past data time (see `past_sensors`); None: the present.

        Returns
        -------
        list of dict
            `id`, `kind` (radar, position or bearing), site, standard deviations, `updates`,
            `last_update_s`, `age_s`, `health` (a row of `health.parquet`, for radars from the end
            of the first epoch on), `biases` (the latest row of `biases.parquet` of each parameter,
            from the end of the first epoch on), `clock_lead_s` (by how much a wrong clock is ahead
            of the data time, s), `storm` (more measurements than it can deliver, in words),
            `diagnoses`. Missing values are None.
        """
        found = self._diagnosis.records(at_s)
        if at_s is not None:
            return past_sensors(self._picture.source(at_s), at_s, found)
        records = self._known.sensor_records()
        leads, storms = self.clock_leads(), self.storms()
        for record in records:
            record["storm"] = storms.get(record["id"])
            record["clock_lead_s"] = leads.get(record["id"])
        add_findings(records, found)
        return records

    def saturated(self) -> list[str]:
        """Return the sensors that could lately initiate no more tracks."""
        return self._known.saturated()

    def picture(self, asked: Asked) -> bytes:
        """Return a frame of the air picture; see `AirPicture.frame`."""
        return self._picture.frame(asked)

    def ready_picture(self, asked: Asked) -> bytes | None:
        """Return a frame that is encoded already, or None; see `AirPicture.ready`."""
        return self._picture.ready(asked)

    def past_picture(self, asked: PastAsked) -> bytes:
        """Return a frame of the air picture at a past time; see `AirPicture.past`."""
        return self._picture.past(asked)

    def status(self) -> dict[str, Any]:
        """Return counts, sequences, data time, alarms, hash of the output and version."""
        ring = self._events.ring
        # First: what is counted as processed is then in the output.
        service = self.service_counts()
        # Before the findings: if it is complete, these are its findings.
        pending = self._diagnosis.is_pending
        known, found = self._known.counts(), self._diagnosis.records()
        alarms: dict[str, list[str]] = {
            sensor_id: names
            for sensor_id, raised in known["sensor_alarms"].items()
            if (names := confirmed(sensor_id, raised, found))
        }
        for name, sensor_ids in ((CLOCK_ALARM, self.clock_leads()), (STORM_ALARM, self.storms())):
            for sensor_id in sensor_ids:
                alarms[sensor_id] = [*alarms.get(sensor_id, []), name]
        raised = [alarms() for alarms in self.further_alarms]
        further = [name for names, _ in raised for name in names]
        warnings = [sentence for _, sentences in raised for sentence in sentences]
        if self.regions is not None:
            silent = self.regions.silent()
            further = [*further, *([REGION_SILENT] if silent else [])]
            warnings = [
                *warnings,
                *(
                    f"no messages from the neighbouring region {one}: this service is now also "
                    "responsible for its aircraft"
                    for one in silent
                ),
            ]
        return {
            **service,
            **known,
            "alarms": list(dict.fromkeys([*service.get("alarms", ()), *further])),
            "warnings": [*service.get("warnings", ()), *warnings],
            "sensor_alarms": alarms,
            "filter": self._known.tracking.filter_name,
            "event_sequence": ring.head,
            "subscribers": ring.subscriber_count,
            "rejected_by_code": self._rejects.counts,
            "rejected_by_source": self._rejects.counts_by_source,
            "duplicates_by_sensor": self._rejects.duplicates_by_sensor,
            "diagnoses": found,
            "diagnosis_pending": pending,
            **{name: counts() for name, counts in self.edge_counts.items()},
        }

    @property
    def sent_before(self) -> int:
        """Number of the last event that was there before this service accepted measurements."""
        return self._events.ring.sent_before

    def subscribe(self, after: int | None, depth: int) -> Subscription:
        """Subscribe to the stream of events.

        Parameters
        ----------
        after : int or None
            The last event received; None: from now on.
        depth : int
            A reader farther behind receives a gap notice instead of the oldest events.
        """
        return self._events.ring.subscribe(after, depth)

    def _marked(self, tracks: pl.DataFrame) -> pl.DataFrame:
        if self.regions is None:
            return tracks
        return tracks.hstack(self.regions.fields(tracks["track_id"].to_numpy()))
