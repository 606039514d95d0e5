"""What recordings contain: accounts of their files, and figures of their sensors."""

from collections import Counter
from dataclasses import dataclass, field

import polars as pl

from multiradar_converters.asterix.decoding.local_plane import ReferencePoint
from multiradar_converters.asterix.decoding.sensor_clocks import Differences
from multiradar_converters.asterix.file_order import FileOrder
from multiradar_converters.inspection.sensor_figures import SensorFigures

#: Name of a sensor in the recording, and kind of its measurements.
SensorKey = tuple[str, str]


@dataclass
class FileSurvey:
    """Account of a file.

    Attributes
    ----------
    file, form : str
        Its name and form.
    size : int
        Its octets.
    read, rejected, duplicates : int
        Records; an undecodable block counts as one.
    octets : Counter
        Octets by disposition: framing, decoded, skipped, quarantined; of text only its size.
    reasons : Counter
        Rejected records, by code and reason.
    """

    file: str
    form: str
    size: int
    read: int = 0
    rejected: int = 0
    duplicates: int = 0
    octets: Counter[str] = field(default_factory=Counter)
    reasons: Counter[tuple[str, str]] = field(default_factory=Counter)


@dataclass
class CategoryFigures:
    """Records of an ASTERIX category of a sensor, and their edition."""

    records: int = 0
    edition: str = ""


@dataclass
class Antenna:
    """Antenna of a radar by its service messages: scan period, s (NaN: none), and site."""

    north_marks: int
    sectors: int
    period_s: float
    site: tuple[float, float, float] | None


@dataclass
class Survey:
    """What recordings contain.

    Attributes
    ----------
    files : list of FileSurvey
        Accounts of the files.
    categories : dict
        ASTERIX records by category and sensor.
    sensors : dict
        Figures by sensor.
    antennas : dict
        Antennas by the name of the radar.
    unknown_editions : list of str
        Why sources were quarantined as a whole.
    differences : list of Differences
        Times of reception beside those of messages, of some messages.
    system_tracks : int
        Updates of system tracks of another tracker.
    reported : list of DataFrame
        Biases reported by another tracker, of each window.
    references : mapping
        Reference points of local coordinates by source: given, else reported (019/600).
    sampled : float
        Fraction of the octets from which the figures of plots are.
    start_s : float or None
        Unix time of the start of the first day, s, if the recorder knows it.
    order : FileOrder
        Days of the ASTERIX recordings.
    """

    files: list[FileSurvey] = field(default_factory=list)
    categories: dict[tuple[int, str], CategoryFigures] = field(default_factory=dict)
    sensors: dict[SensorKey, SensorFigures] = field(default_factory=dict)
    antennas: dict[str, Antenna] = field(default_factory=dict)
    unknown_editions: list[str] = field(default_factory=list)
    differences: list[Differences] = field(default_factory=list)
    system_tracks: int = 0
    reported: list[pl.DataFrame] = field(default_factory=list)
    references: dict[int, ReferencePoint] = field(default_factory=dict)
    sampled: float = 1.0
    start_s: float | None = None
    order: FileOrder = field(default_factory=FileOrder)

    def sensor(self, key: SensorKey) -> SensorFigures:
        """Return the figures of a sensor, new ones for a new sensor."""
        return self.sensors.setdefault(key, SensorFigures())

    def category(self, category: int, sensor: str) -> CategoryFigures:
        """Return the figures of a category of a sensor."""
        return self.categories.setdefault((category, sensor), CategoryFigures())
