"""Sends system tracks to users, in data time, in its own thread."""

import logging
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.asterix_output.sinks import Sink
from multiradar.runtime.asterix.channel import Channel
from multiradar.runtime.asterix.cycles import ChannelBlocks, Cycles
from multiradar.runtime.live.output_feed import FeedItem, OutputFeed
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings

_log = logging.getLogger(__name__)


class Outlet:
    """The output of one user: its channel, its sink and its counters; one owner.

    Parameters
    ----------
    name : str
        Its name in counters.
    channel : Channel
        Content.
    sink : Sink
        Destination.
    """

    def __init__(self, name: str, channel: Channel, sink: Sink) -> None:
        self.name = name
        self.channel = channel
        self.sink = sink
        self.sent = 0
        self.dropped = 0
        self.octets = 0

    def send(self, blocks: Sequence[bytes]) -> bool:
        """Send blocks; False when some of them were dropped."""
        sent = self.sink.send(blocks)
        self.sent += sent
        self.dropped += len(blocks) - sent
        self.octets += sum(map(len, blocks)) if sent == len(blocks) else 0
        return sent == len(blocks)

    def counts(self) -> dict[str, Any]:
        """Return blocks sent and dropped, octets, and records by category and omitted item."""
        return {
            "blocks_sent": self.sent,
            "blocks_dropped": self.dropped,
            "octets": self.octets,
            # A copy first: the sender keeps counting.
            "records": dict(sorted(dict(self.channel.counts).items())),
        }


class AsterixSender:
    """Sends the output of the engine to the users.

    Parameters
    ----------
    feed : OutputFeed
        The engine's output, with details.
    live_ids : callable
        Returns the identifiers of the live tracks.
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    outlets : sequence of Outlet
        The users.
    """

    def __init__(
        self,
        feed: OutputFeed,
        live_ids: Callable[[], NDArray[np.int64]],
        sensors: SensorTable,
        tracking: TrackingSettings,
        outlets: Sequence[Outlet],
    ) -> None:
        self._feed = feed
        self._live_ids = live_ids
        self._sensors = sensors
        self._tracking = tracking
        self._outlets = outlets
        self._cycles = self._begin()
        # Nothing is sent before the first catch-up, and nothing twice: neither output up to an
        # update, whose numbers are repeated when the engine restarts, nor, of the output after it,
        # reports of the data time that had been reached at that update.
        self._replaying = True
        self._silent_until, self._silent_until_s = 0, -math.inf
        # Last update since the engine was started.
        self._update = 0
        self._failure: str | None = None
        self._thread = threading.Thread(target=self._run, name="asterix-output", daemon=True)

    def start(self) -> None:
        """Read the output; nothing is sent before `begin`."""
        self._thread.start()

    def begin(self) -> None:
        """Send from now on: the journal has been replayed."""
        self._feed.catch_up()

    def stop(self) -> None:
        """Send what is left and the end of service, then close."""
        self._feed.close()
        if self._thread.ident is not None:
            self._thread.join()
        for outlet in self._outlets:
            outlet.sink.close()

    def counts(self) -> dict[str, Any]:
        """Return the counters of each user."""
        return {
            "updates_dropped": self._feed.dropped,
            "failure": self._failure,
            "unnumbered_tracks": self._cycles.tracks.numbers.unassigned,
            "outputs": {outlet.name: outlet.counts() for outlet in self._outlets},
        }

    def step(self, fed: FeedItem) -> None:
        """Process the next output and send what is due."""
        if fed.restarted:
            self._restart()
        elif fed.set_back:
            self._set_back()
        elif fed.caught_up:
            self._replaying = False
            self._silent_until = max(fed.reached, self._update)
            self._silent_until_s = max(fed.reached_s, self._cycles.reached_s)
            # Losses during the replay of the journal affect no user.
            self._cycles.overloaded.clear()
        elif fed.lost:
            self._cycles.overloaded = set(range(len(self._outlets)))
            self._cycles.tracks.retain(self._live_ids())
        elif fed.sensors is not None:
            self._sensors = fed.sensors
            self._cycles.use(fed.sensors)
        elif fed.output is not None:
            self._process(fed.output)

    # ---------------------------------------------------------------- inside

    def _begin(self) -> Cycles:
        return Cycles(self._sensors, self._tracking, [one.channel for one in self._outlets])

    def _run(self) -> None:
        try:
            while (fed := self._feed.pop()) is not None:
                self.step(fed)
            self._send(self._cycles.finish())
        except Exception as error:
            # The service continues without this thread.
            self._failure = repr(error)
            self._feed.close()
            _log.exception("ASTERIX output has stopped")

    def _restart(self) -> None:
        if not self._is_silent:
            self._silent_until, self._silent_until_s = self._update, self._cycles.reached_s
        self._cycles, self._update = self._begin(), 0

    def _set_back(self) -> None:
        if not self._is_silent:
            self._silent_until_s = -math.inf
        self._cycles = self._begin()

    @property
    def _is_silent(self) -> bool:
        return self._replaying or self._update < self._silent_until

    def _process(self, output: EngineOutput) -> None:
        self._update = int(output.updates.sequence.max(initial=self._update))
        is_repeated = len(output.updates) and self._update <= self._silent_until
        if self._replaying or is_repeated:
            self._cycles.absorb(output)
        else:
            self._send(self._cycles.push(output))

    def _send(self, reports: Iterator[ChannelBlocks]) -> None:
        for one in reports:
            if self._is_silent or one.time_s <= self._silent_until_s:
                continue
            if not self._outlets[one.channel].send(one.blocks):
                self._cycles.overloaded.add(one.channel)
