"""What the engine put out, handed to everything that reads it."""

from collections.abc import Callable
from typing import Any

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.live.live_diagnosis import LiveDiagnosis
from multiradar.runtime.live.output_feed import OutputReader
from multiradar.runtime.live.view import LiveView
from multiradar.runtime.memory.knowledge import Knowledge, States
from multiradar.runtime.memory.reject_board import RejectBoard
from multiradar.runtime.stream.output_events import OutputEvents
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings


class Publication:
    """Hands the output of the engine to the view, the stream of events and other readers.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker; coasting and forecasts use them.
    limits : RuntimeLimits
        Bounds of rings and pages.
    """

    def __init__(
        self, sensors: SensorTable, tracking: TrackingSettings, limits: RuntimeLimits
    ) -> None:
        self._known = Knowledge(sensors, tracking, limits)
        self._events = OutputEvents(sensors, limits)
        self.diagnosis = LiveDiagnosis(sensors)
        self._readers: list[OutputReader] = [self.diagnosis]
        #: What was rejected, by reason.
        self.refusals = RejectBoard(sensors, limits.rejects_kept_max)
        #: What all of this looks like to a reader.
        self.view = LiveView(self._known, self._events, self.refusals, self.diagnosis)

    def count_edge(self, name: str, counts: Callable[[], dict[str, Any]]) -> None:
        """Have the status report, under a name of its own, what an edge of the service counts.

        Before the start: readers do not expect the parts of the status to change.
        """
        self.view.edge_counts[name] = counts

    def keep(self, trajectories: TrajectoryFeed) -> None:
        """Have bundles of trajectories made of the output. Before the start."""
        self._known.trajectories = trajectories
        self.feed(trajectories)
        self.count_edge("trajectories", trajectories.counts)

    def feed(self, reader: OutputReader) -> None:
        """Have all output of the engine handed to a reader, too. Before the start."""
        self._readers.append(reader)

    def attach(self, states: Callable[[], States], counts: Callable[[], dict[str, Any]]) -> None:
        """Name where the states of the filter, in their plane, and the counters come from."""
        self._known.attach(states)
        self.view.service_counts = counts

    def publish(self, output: EngineOutput, data_time_s: float | None) -> None:
        """Hand on what the engine put out; on the engine's thread.

        Parameters
        ----------
        output : EngineOutput
            Output of one call.
        data_time_s : float or None
            Greatest data time handed to the engine; None before the first measurement.
        """
        self._known.absorb(output, data_time_s)
        self._events.publish(output)
        for reader in self._readers:
            reader.put(output)

    def restart(self) -> None:
        """Discard everything: the journal is about to be played again from its beginning."""
        self._known.clear()
        self.refusals.clear()
        self._events.restart()
        for reader in self._readers:
            reader.restart()
