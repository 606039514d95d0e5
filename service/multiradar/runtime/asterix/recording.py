"""System tracks of a recording, in a file of ASTERIX blocks."""

from pathlib import Path
from typing import BinaryIO

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.asterix.cycles import Cycles
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings


class AsterixRecorder:
    """Writes the output of the engine to a file of ASTERIX blocks.

    Parameters
    ----------
    path : Path
        The file; it is overwritten.
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    options : ChannelOptions
        Output options.
    """

    def __init__(
        self,
        path: Path,
        sensors: SensorTable,
        tracking: TrackingSettings,
        options: ChannelOptions,
    ) -> None:
        self._channel = Channel(options)
        self._cycles = Cycles(sensors, tracking, [self._channel])
        self._file: BinaryIO = path.open("wb")

    def write(self, output: EngineOutput) -> None:
        """Write the reports due after an output."""
        for sent in self._cycles.push(output):
            self._file.writelines(sent.blocks)

    def finish(self) -> dict[str, int]:
        """Write the last reports, and the end of the service.

        Returns
        -------
        dict
            Records by category; items omitted because a value does not fit, by category and item;
            and `unnumbered`: tracks not reported because no number was free.
        """
        for sent in self._cycles.finish():
            self._file.writelines(sent.blocks)
        counts = dict(sorted(self._channel.counts.items()))
        unassigned = self._cycles.tracks.numbers.unassigned
        return counts | ({"unnumbered": unassigned} if unassigned else {})

    def close(self) -> None:
        """Close the file."""
        self._file.close()
