"""Options of a conversion."""

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass, field

from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint, references_of
from multiradar_schemas.sensors.sensor import SensorsFile


@dataclass(frozen=True)
class Options:
    """Options; the defaults detect as much as possible.

    Attributes
    ----------
    sensors : SensorsFile or None
        Sensors, for their ids by SAC and SIC.
    date : date or None
        First day of the recording.
    editions : Editions
        Selected editions; detected ones are added.
    all_targets : bool
        Whether to include test targets, simulated targets, fixed transponders and reports without
        detection.
    records : bool
        Whether to write `records.ndjson`.
    references : mapping
        Reference points of local coordinates by source; they take precedence over `sensors`.
    """

    sensors: SensorsFile | None = None
    date: dt.date | None = None
    editions: Editions = field(default_factory=Editions)
    all_targets: bool = False
    records: bool = False
    references: Mapping[int, ReferencePoint] = field(default_factory=dict)

    def scan_periods(self) -> dict[int, float]:
        """Return the scan periods in `sensors`, s, by source."""
        return {
            one.sac << 8 | one.sic: one.rotation_period_s
            for one in (self.sensors.sensor if self.sensors else ())
            if one.sac is not None and one.sic is not None and one.rotation_period_s is not None
        }

    def reference_points(self) -> dict[int, ReferencePoint]:
        """Return the reference points by source that are configured."""
        return references_of(self.sensors.sensor if self.sensors else ()) | dict(self.references)

    def settings(self) -> dict[str, object]:
        """Return the options that affect the output, for `report.json`."""
        given = (text.rpartition("=") for text in self.editions.texts.values())
        return {
            "date": None if self.date is None else self.date.isoformat(),
            "sensors": None if self.sensors is None else [one.id for one in self.sensors.sensor],
            "editions": {source: edition for source, _, edition in given},
            "all_targets": self.all_targets,
            "references": {
                f"{source >> 8}-{source & 255}": list(point)
                for source, point in sorted(self.references.items())
            },
        }
