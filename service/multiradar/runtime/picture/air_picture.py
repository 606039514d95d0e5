"""Frames of the air picture: live tracks, and plots with and without the estimated biases."""

import threading
from typing import NamedTuple

import numpy as np

from multiradar.clock import Clock
from multiradar.errors import RequestError
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.picture.bearing_lines import mark_tables
from multiradar.runtime.picture.frames import encoded
from multiradar.runtime.picture.joined_past import JoinedPast
from multiradar.runtime.picture.past import (
    ENDING_S,
    PATH_S,
    PLOTS_S,
    PastAsked,
    PastFiles,
    RecordedSource,
    past_frame,
    path_columns,
)
from multiradar.runtime.picture.past_sensors import SILENT_S
from multiradar.runtime.picture.recent_plots import PLOTS_KEPT, RecentPlots
from multiradar.runtime.picture.retained import RetainedPast
from multiradar.runtime.picture.selection import WHOLE_MAX, WORLD, Area, Columns, at, shown
from multiradar.runtime.picture.track_columns import system_plane, track_columns
from multiradar.tracking.outputs import STATE_NAMES

#: Maximum plots of a frame for a page that has some: one that was away longer, or a replay far
#: above real time, misses the oldest. A new page gets all that are retained.
PLOTS_MAX = 4_096
#: A page that has no plots yet gets those of the last seconds, s of data time.
PLOTS_FIRST_S = 30.0
#: Shortest time between two states of the picture, s: all pages read the same one.
TICK_S = 0.1
#: Fraction of the time that making states may take; with many tracks and plots they are rarer.
SHARE_MAX = 0.03
#: Longest pause between two states, s: one that took seconds because the machine was busy must not
#: stop the picture for minutes.
PAUSE_MAX_S = 2.0
#: Encoded frames retained until the next tick.
_FRAMES_MAX = 64


class Asked(NamedTuple):
    """What a page asks for.

    Attributes
    ----------
    after : int or None
        `next` of its last frame: only plots since then; None: those of the last seconds.
    area : Area or None
        What it shows; counts where there are more than `WHOLE_MAX` tracks.
    track : int or None
        A track that is always included in the frame.
    """

    after: int | None = None
    area: Area | None = None
    track: int | None = None


class AirPicture:
    """Frames for the page, for any thread.

    The state is read at most every `TICK_S`, rarer where that takes more than `SHARE_MAX`, with
    pauses of at most `PAUSE_MAX_S`; each frame of a tick is encoded once for all pages that ask for
    the same.

    Parameters
    ----------
    known : Knowledge
        Tracks, plots and biases.
    clock : Clock
        Times the ticks.
    """

    def __init__(self, known: Knowledge, clock: Clock) -> None:
        self._known = known
        self._clock = clock
        self._lock = threading.Lock()
        self._plots = RecentPlots(known)
        #: What is retained of the past.
        self.retained = RetainedPast(known)
        #: What is on disk of earlier times; None without a history.
        self.history: PastFiles | None = None
        self._plane = system_plane(known.sensors)
        self._version = -1
        self._due_s = -np.inf
        self._data_time_s: float | None = None
        self._tracks: Columns = {}
        self._bundles: list[int] = []
        self._frames: dict[Asked, bytes] = {}
        #: Frames encoded, and those answered with one already encoded.
        self.encoded = 0
        self.shared = 0

    def frame(self, asked: Asked) -> bytes:
        """Return the picture.

        Parameters
        ----------
        asked : Asked
            What the page asks for.

        Returns
        -------
        bytes
            A frame (see `frames`): tables `tracks` (see `track_columns`), `plots` (see
            `RecentPlots.after`), `bearings` if there are any (see `marks`), and, for a new page,
            `path` (see `path_columns`), and in the header
            `data_time_s`, `next`, `sensors` (identifiers, by their number in `plots`), `states`
            (names, by number in `tracks`), `skipped` (plots that are no longer retained), `total`
            (live tracks, of which `tracks` may be a part), `bundles` (tracks with a bundle)
            and `span_s` (the first and last time of which `past` has the picture).
        """
        with self._lock:
            if self._is_due():
                self._tick()
            asked = self._normal(asked)
            frame = self._shared(asked)
            if frame is not None:
                return frame
            frame = self._encoded(asked)
            self.encoded += 1
            if len(self._frames) < _FRAMES_MAX:
                self._frames[asked] = frame
            return frame

    def ready(self, asked: Asked) -> bytes | None:
        """Return the picture if its frame is encoded already, without waiting; else None."""
        if not self._lock.acquire(blocking=False):
            return None
        try:
            return None if self._is_due() else self._shared(self._normal(asked))
        finally:
            self._lock.release()

    def past(self, asked: PastAsked) -> bytes:
        """Return the picture at a past time; see `past_frame`.

        Raises
        ------
        RequestError
            If there is no such layer; the service has one, 0.
        """
        if asked.layer:
            raise RequestError(
                404, "LAYER_NOT_FOUND", "no such layer; the service has only layer 0"
            )
        return past_frame(self.source(asked.at_s), asked, {"span_s": self.span_s()})

    def source(self, at_s: float) -> RecordedSource:
        """Return what is known of a past time.

        Each table is from memory where memory has it completely, else from the files as far as
        they are written; later times memory alone has, completely or not.
        """
        known, files = self._known, self.history
        tracks_s = max(PATH_S, SILENT_S, known.tracking.drop_after_s + ENDING_S)
        complete = [
            at_s - span_s >= known.past.complete_from_s(*names)
            for names, span_s in (
                (("updates", "transitions"), tracks_s), (("plots",), PLOTS_S),
                (("biases",), PATH_S), (("health",), PATH_S),
            )
        ]  # fmt: skip
        written_s = None if files is None or all(complete) else files.written_s
        if files is None or written_s is None or at_s > written_s:
            return self.retained
        recorded = files.at(at_s)
        if recorded is None:
            return self.retained
        return JoinedPast(*(self.retained if whole else recorded for whole in complete))

    def span_s(self) -> tuple[float, float] | None:
        """Return the first and the last time of which there are tracks, s; None without any."""
        oldest_s, data_time_s = self._known.past.oldest_s, self._known.data_time_s
        if oldest_s is None or data_time_s is None:
            return None
        earlier_s = None if self.history is None else self.history.oldest_s
        oldest_s = oldest_s if earlier_s is None else min(oldest_s, earlier_s)
        return oldest_s, max(oldest_s, data_time_s)

    # Whether the next frame needs a new state.
    def _is_due(self) -> bool:
        return self._version != self._known.version and self._clock.monotonic_s() >= self._due_s

    def _shared(self, asked: Asked) -> bytes | None:
        frame = self._frames.get(asked)
        self.shared += frame is not None
        return frame

    # Pages that get the same frame ask for the same.
    def _normal(self, asked: Asked) -> Asked:
        if len(self._tracks.get("track_id", ())) <= WHOLE_MAX:
            return Asked(asked.after)
        return asked if asked.area is not None else asked._replace(area=WORLD)

    def _tick(self) -> None:
        began_s = self._clock.monotonic_s()
        air = self._known.air_tracks()
        self._plots.update()
        self._version, self._data_time_s = air.version, air.data_time_s
        self._tracks = track_columns(air, self._plane, self.retained.acceleration_density)
        feed = self._known.trajectories
        self._bundles = [] if feed is None else feed.tracks()
        self._frames.clear()
        ended_s = self._clock.monotonic_s()
        pause_s = max(TICK_S, min((ended_s - began_s) / SHARE_MAX, PAUSE_MAX_S))
        self._due_s = ended_s + pause_s

    def _encoded(self, asked: Asked) -> bytes:
        since_s = (self._data_time_s or 0.0) - PLOTS_FIRST_S
        most = PLOTS_KEPT if asked.after is None else PLOTS_MAX
        found, skipped = self._plots.after(asked.after, most, since_s)
        tracks, total = self._tracks, len(self._tracks["track_id"])
        if asked.area is not None:
            tracks = at(tracks, shown(tracks, asked.area, asked.track))
        members = {
            "data_time_s": self._data_time_s,
            "next": self._plots.next,
            "skipped": skipped,
            "total": total,
            "bundles": self._bundles,
            "span_s": self.span_s(),
            "sensors": list(self._known.sensors.ids),
            "states": list(STATE_NAMES),
        }
        tables = {"tracks": tracks, **mark_tables(found, asked.area)}
        if asked.after is None and self._data_time_s is not None:
            # A new page: earlier positions as in the history.
            path_s = self._data_time_s - PATH_S
            recent = self.retained.positions(path_s, self._data_time_s)
            tables["path"] = path_columns(recent, path_s, tracks["track_id"])
        return encoded(members, tables)
