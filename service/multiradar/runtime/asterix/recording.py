"""System tracks of a recording, in a file of ASTERIX blocks."""

from pathlib import Path
from typing import BinaryIO

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.asterix.cycles import Cycles
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings


class AsterixRecorder:
    """Writes what the engine puts out to a file, blocks one after another.

    Parameters
    ----------
    path : Path
        The file; what is there is written over.
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    options : ChannelOptions
        What is written.
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

    def take(self, output: EngineOutput) -> None:
        """Write what the output makes known."""
        for told in self._cycles.take(output):
            self._file.writelines(told.blocks)

    def finish(self) -> dict[str, int]:
        """Write the last state, and that the service ends.

        Returns
        -------
        dict
            Records by category; items left out since they could not hold a value, by category and
            item; and `unnumbered`, how often a track was not told of since no number was free.
        """
        for told in self._cycles.finish():
            self._file.writelines(told.blocks)
        counts = dict(sorted(self._channel.counts.items()))
        refused = self._cycles.tracks.numbers.refused
        return counts | ({"unnumbered": refused} if refused else {})

    def close(self) -> None:
        """Close the file."""
        self._file.close()
