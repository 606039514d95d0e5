"""Distribution of the engine's output to its readers."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Protocol

from numpy.typing import NDArray

from multiradar.clock import Clock, SystemClock
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.observability.traces import MessageTraces
from multiradar.runtime.live.alarms.silence import Silence
from multiradar.runtime.live.backlog import Backlog, Journalled
from multiradar.runtime.live.live_diagnosis import LiveDiagnosis
from multiradar.runtime.live.output_feed import OutputReader
from multiradar.runtime.live.threads import Threads
from multiradar.runtime.live.view import LiveView
from multiradar.runtime.memory.knowledge import Knowledge, States
from multiradar.runtime.memory.regions.board import RegionBoard
from multiradar.runtime.memory.reject_board import RejectBoard
from multiradar.runtime.picture.past import PastFiles
from multiradar.runtime.queries.neighbouring_regions import region_document
from multiradar.runtime.row_ring import RowLog
from multiradar.runtime.stream.output_events import OutputEvents
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.settings.limits import RuntimeLimits
from multiradar.state import Fields
from multiradar.storage.journal import Journal
from multiradar.tracking.outputs import NO_OUTPUT, EngineOutput
from multiradar.tracking.settings import TrackingSettings


class Processed(Protocol):
    """What processes the journal."""

    processed: int


class Recorder(Protocol):
    """Keeps the output on disk, in a thread of its own."""

    def start(self, journal: Journal, processor: Processed) -> None:
        """Continue with what is processed from now on."""
        ...

    def stop(self) -> None:
        """Write what there is, and end."""
        ...

    def document(self) -> dict[str, Any]:
        """Return its counters."""
        ...

    def alarms(self) -> tuple[list[str], list[str]]:
        """Return its alarms, and warnings in words."""
        ...


class Publication:
    """Distributes the output of the engine to the view, the event stream and other readers.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker; coasting and forecasts use them.
    limits : RuntimeLimits
        Bounds of rings and pages.
    clock : Clock, optional
        Times the states of the air picture; the system clock by default.
    threads : Threads, optional
        Starts threads; those of the system by default.
    """

    STATE: ClassVar[Fields] = {"_known": Knowledge, "rejects": RejectBoard, "_events": OutputEvents}

    def __init__(
        self, sensors: SensorTable, tracking: TrackingSettings, limits: RuntimeLimits,
        clock: Clock | None = None, threads: Threads | None = None,
    ) -> None:  # fmt: skip
        self._known = Knowledge(sensors, tracking, limits)
        self._events = OutputEvents(sensors, limits)
        self.diagnosis = LiveDiagnosis(
            sensors, lambda: self._known.data_time_s, threads=threads, clock=clock
        )
        self._readers: list[OutputReader] = [self.diagnosis]
        self._recorder: Recorder | None = None
        self._regions: RegionBoard | None = None
        self._silence: Silence | None = None
        #: Notes the times of messages; None where they are not traced.
        self.traces: MessageTraces | None = None
        #: Readers that need the whole output again after a restart.
        self.repeating: list[str] = []
        #: Rejected rows by code.
        self.rejects = RejectBoard(sensors, limits.rejects_kept_max)
        #: The read interface.
        self.view = LiveView(
            self._known, self._events, self.rejects, self.diagnosis, clock or SystemClock()
        )

    def count_edge(self, name: str, counts: Callable[[], dict[str, Any]]) -> None:
        """Add the counters of an interface to the status, under a name.

        To be called before the start: the members of the status do not change afterwards.
        """
        self.view.edge_counts[name] = counts

    def watch_silence(self, silence: Silence) -> None:
        """Age the tracks by reception, too, and date the events. To be called before the start."""
        self._silence = silence
        self._events.delay_s = lambda: silence.delay_s
        self._known.silence = lambda: (silence.duration_s, silence.has_ceased)

    def keep(self, trajectories: TrajectoryFeed) -> None:
        """Reconstruct trajectory bundles from the output. To be called before the start."""
        self._known.trajectories = trajectories
        self.feed(trajectories, "trajectories")
        self.count_edge("trajectories", trajectories.counts)

    def divide(self, regions: RegionBoard) -> None:
        """Share the aircraft with neighbouring regions. To be called before the start."""
        self._regions = self.view.regions = regions
        self._events.add_marks(regions.name)
        self._known.regions = lambda: region_document(regions)

    @property
    def parts(self) -> dict[str, Any]:
        """What has a state of its own, by name: the regions, if there are any."""
        return {} if self._regions is None else {"regions": self._regions}

    def hand_over(self, message: bytes) -> EngineOutput:
        """Use the message of a neighbouring region; the engine has no output of it."""
        if self._regions is not None:
            self._regions.hand_over(message)
        return NO_OUTPUT

    def keep_history(self, recorder: "Recorder", files: PastFiles) -> None:
        """Write a history of the output, and answer from it. To be called before the start."""
        self._recorder = recorder
        self.view.keep_history(files, recorder.alarms)
        self.count_edge("history", recorder.document)

    def start(self, journal: Journal, processor: Processed, backlog: Backlog) -> None:
        """Begin with what runs beside the engine, once the journal was replayed."""
        backlog.traces = self.traces
        self.diagnosis.start()
        if self._recorder is not None:
            self._recorder.start(journal, processor)

    def stop(self) -> None:
        """End what runs beside the engine; the journal is still open."""
        self.diagnosis.stop()
        if self._recorder is not None:
            self._recorder.stop()

    @property
    def known(self) -> Knowledge:
        """The output so far, for what is kept of it."""
        return self._known

    def feed(self, reader: OutputReader, name: str) -> None:
        """Add a reader of all output of the engine, with a name for the log; before the start."""
        self._readers.append(reader)
        self.repeating.append(name)

    def attach(self, states: Callable[[], States], counts: Callable[[], dict[str, Any]]) -> None:
        """Set the sources of the filter states, in their plane, and of the counters."""
        self._known.attach(states)
        self.view.service_counts = counts

    def publish(
        self, output: EngineOutput, data_time_s: float | None, ends_stream: bool = False
    ) -> None:
        """Distribute output of the engine; in the engine's thread.

        Parameters
        ----------
        output : EngineOutput
            Output of one call.
        data_time_s : float or None
            Greatest data time of the engine's input; None before the first measurement.
        ends_stream : bool
            Whether it is the output of the end of a stream.
        """
        if self.traces is not None:
            self.traces.stepped()
        marks = None if self._regions is None else self._regions.absorb(output)
        self._known.absorb(output, data_time_s)
        self._events.publish(output, marks)
        for reader in self._readers:
            reader.put(output)
        if ends_stream:
            self.diagnosis.end_stream()
        if self.traces is not None:
            self.traces.published()

    def publish_change(self, change: Mapping[str, Any]) -> None:
        """Distribute a change of a sensor, after its output; as in the status."""
        self._events.publish_change(change)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        self._known.use(sensors)
        self._events.sensors = self.rejects.sensors = sensors
        for reader in self._readers:
            reader.use(sensors)

    def set_back(self) -> None:
        """Expect earlier times: the data clock was set back, and all tracks were terminated."""
        self._known.set_back()
        self._events.set_back()
        if self._regions is not None:
            self._regions.set_back()
        for reader in self._readers:
            reader.set_back()

    def hear(self, group: Sequence[Journalled]) -> None:
        """Note the measurements that another service has accepted, before their output."""
        clock_s = group[-1].clock_s
        was_heard = math.isfinite(clock_s) and any(len(one.batch) for one in group)
        if self._silence is not None and was_heard:
            self._silence.hear(clock_s)

    def followed(self, *, is_first: bool = False) -> None:
        """Note that entries of another service were processed, the first time in a replay."""
        if is_first:
            self._events.ring.settle()
        if self._silence is None:
            return
        self._silence.use(self._known.sensors)
        if is_first and self._known.data_time_s is not None:
            self._silence.resume(self._known.data_time_s)

    def follow(self) -> None:
        """Expect readers that already have later events: of another service, or before a start."""
        self._events.ring.follow()

    def lead(self) -> None:
        """Send the next events: all that another service has sent are here."""
        self._events.ring.lead()

    def end(self) -> None:
        """End all streams of events: the service was drained."""
        self._events.ring.end()

    @property
    def logs(self) -> dict[str, RowLog]:
        """Rows that are only ever appended, by name."""
        return {**self._known.logs, **self._events.logs}

    def refill(self, rows: Mapping[str, NDArray[Any]]) -> None:
        """Make the events again, after the logs were refilled with rows."""
        self._events.refill(rows["history"], rows["biases"])

    def restart(self, sensors: SensorTable) -> None:
        """Discard everything: the journal is replayed from the start, with its first sensors.

        Readers of events may have later ones, until `lead`.
        """
        self.follow()
        self.use(sensors)
        self._known.clear()
        self.rejects.clear()
        self._events.restart()
        if self._regions is not None:
            self._regions.clear()
        for reader in self._readers:
            reader.restart()
