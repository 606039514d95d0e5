"""Recorded runs in place of the running service: the same routes, and the same page."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
import polars as pl

from multiradar.errors import RequestError
from multiradar.runtime.live.readiness import Reason
from multiradar.runtime.memory.sensor_board import SensorBoard
from multiradar.runtime.picture.air_picture import Asked
from multiradar.runtime.picture.past import PastAsked, past_frame
from multiradar.runtime.picture.past_sensors import past_sensors
from multiradar.runtime.picture.past_tracks import not_retained, past_tracks
from multiradar.runtime.picture.sensor_findings import add_findings
from multiradar.runtime.ports import EventSource
from multiradar.runtime.queries.registry import BIASES, UPDATES, History, Query
from multiradar.runtime.recorded.run import RecordedRun, final_diagnoses
from multiradar.storage.entries import Quarantined

_PAGE_ROWS_MAX = 10_000


class RecordedView:
    """The read interface of recorded runs, for any thread.

    Parameters
    ----------
    runs : sequence of RecordedRun
        One layer each; tracks, sensors and histories are those of the first.
    """

    def __init__(self, runs: Sequence[RecordedRun]) -> None:
        self._runs = tuple(runs)
        spans = [run.span_s() for run in runs]
        self._span_s = min(one[0] for one in spans), max(one[1] for one in spans)
        self._extent_deg = self._runs[0].extent_deg()
        self._updates = self._runs[0].updates_by_sensor()
        self._health = {row["sensor_id"]: row for row in self._runs[0].health_records(np.inf)}

    @property
    def page_rows_max(self) -> int:
        """Maximum rows of one page of a history."""
        return _PAGE_ROWS_MAX

    def tracks(self, at_s: float | None = None) -> pl.DataFrame:
        """Return the tracks at a time or, None, the end of the run: `tracks.parquet`, `age_s`.

        Raises
        ------
        RequestError
            If the run does not cover the time.
        """
        run = self._runs[0]
        span_s = run.span_s()
        if at_s is None:
            rows = run.tracks(span_s[1])
            return rows.with_columns(age_s=span_s[1] - rows["time_s"])
        if not span_s[0] <= at_s <= span_s[1]:
            raise not_retained(at_s, span_s)
        return past_tracks(run.tracks(at_s), at_s, run.coast_after_s)

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return one track at the end of the run."""
        rows = self.tracks().filter(pl.col("track_id") == track_id)
        return rows.row(0, named=True) if len(rows) else None

    def aircraft_json(self) -> bytes:
        """Raise RequestError: nothing is live in a recorded run."""
        raise _not_recorded("aircraft.json")

    def receiver_json(self) -> dict[str, Any]:
        """Raise RequestError: nothing is live in a recorded run."""
        raise _not_recorded("receiver.json")

    def ask(
        self, query: Query, track_id: int | None = None, at_s: float | None = None, /, **given: Any
    ) -> dict[str, Any] | None:
        """Raise RequestError: queries need the states of the filter, which a run does not keep."""
        raise _not_recorded(query.name)

    def rows(
        self,
        history: History,
        subject: int | str,
        since_s: float | None,
        limit: int,
        until_s: float | None = None,
    ) -> pl.DataFrame:
        """Return rows of a track or a sensor, oldest first."""
        run = self._runs[0]
        if history is BIASES:
            return run.bias_history(str(subject), since_s, limit, until_s)
        read = run.updates if history is UPDATES else run.transitions
        return read(int(subject), since_s, limit, until_s)

    def sensors(self, at_s: float | None = None) -> list[dict[str, Any]]:
        """Return the sensors at a time or, None, at the end of the run; see `LiveView.sensors`.

        Findings are those of the whole run.
        """
        run, end_s = self._runs[0], self._span_s[1]
        found = final_diagnoses(run.report)
        if at_s is not None:
            return past_sensors(run, at_s, found)
        biases = run.bias_records(np.inf)
        records = SensorBoard(run.sensors).records(None)
        for record in records:
            name = record["id"]
            count, last_s = self._updates.get(name, (0, None))
            record["updates"], record["last_update_s"] = count, last_s
            record["age_s"] = None if last_s is None else max(end_s - last_s, 0.0)
            record["health"] = self._health.get(name)
            record["biases"] = [bias for bias in biases if bias["sensor_id"] == name]
        add_findings(records, found)
        return records

    def picture(self, asked: Asked) -> bytes:
        """Return the picture at the end of the runs."""
        return self.past_picture(PastAsked(self._span_s[1], area=asked.area, track=asked.track))

    def ready_picture(self, asked: Asked) -> None:
        """Return None: no frame is kept."""

    def past_picture(self, asked: PastAsked) -> bytes:
        """Return the picture of a run at a time; see `past_frame`.

        Raises
        ------
        RequestError
            If there is no such layer.
        """
        if not 0 <= asked.layer < len(self._runs):
            raise RequestError(404, "LAYER_NOT_FOUND", f"expected a layer below {len(self._runs)}")
        members: dict[str, object] = {
            "recorded": True,
            "span_s": self._span_s,
            "extent_deg": self._extent_deg,
            "layers": [run.name for run in self._runs],
        }
        return past_frame(self._runs[asked.layer], asked, members)

    def status(self) -> dict[str, Any]:
        """Return the counts of the first run, from its report."""
        report = self._runs[0].report
        counts, figures = (report.get(name) or {} for name in ("counts", "figures"))
        return {
            "version": version("multiradar"),
            "state": "recorded",
            "filter": (report.get("settings") or {}).get("filter_name"),
            "data_time_s": self._span_s[1],
            "tracks": 0,
            "tracks_initiated": figures.get("tracks", 0),
            "tracks_confirmed": figures.get("tracks_confirmed", 0),
            "tracks_confirmed_live": 0,
            "tracks_ended": figures.get("tracks", 0),
            **{name: counts.get(name) for name in ("read", "accepted", "rejected", "duplicate")},
            "rejected_by_code": report.get("rejected_by_code", {}),
            "duplicates_by_sensor": figures.get("duplicates_by_sensor", {}),
            "diagnoses": final_diagnoses(report),
            "diagnosis_pending": False,
            "subscribers": 0,
        }

    def subscribe(self, after: int | None, depth: int) -> EventSource:
        """Raise RequestError: nothing is live in a recorded run."""
        del after, depth
        raise _not_recorded("stream")


class RecordedService:
    """Recorded runs as a service that HTTP reads.

    Parameters
    ----------
    runs : sequence of RecordedRun
        One layer each.
    """

    def __init__(self, runs: Sequence[RecordedRun]) -> None:
        self._view = RecordedView(runs)

    @property
    def view(self) -> RecordedView:
        """The read side."""
        return self._view

    def unready(self) -> Sequence[Reason]:
        """Return none: a run is not expected to go on."""
        return ()

    @property
    def stalled(self) -> str:
        """Empty."""
        return ""

    @property
    def start_step(self) -> str:
        """Empty."""
        return ""

    def quarantined(self, after: int, limit: int, code: str | None = None) -> Sequence[Quarantined]:
        """Return none: those of a run are in its `rejects.ndjson`."""
        del after, limit, code
        return ()


def _not_recorded(name: str) -> RequestError:
    return RequestError(
        404,
        "NOT_RECORDED",
        f"{name}: only available from a running service, not from a recorded run",
    )
