"""Options of a conversion."""

import datetime as dt
from dataclasses import dataclass, field

from multiradar_converters.vid.profile import Profile

#: Kinds of track files: ADS-B tracks, multiradar tracks of the recording system, its mono-radar
#: tracks, radar plots that these reference.
TRACK_KINDS = ("ads", "multiradar", "monoradar", "plots")


@dataclass(frozen=True)
class Options:
    """Options; the defaults convert everything.

    Attributes
    ----------
    aircraft_max : int or None
        AZN_TRACKS_MAX: maximum number of aircraft, those with most ADS-B reports.
    ads_measurements_min : int
        AZN_TRACKS_MIN_MEASUR: minimum number of ADS-B reports of an aircraft.
    sensor_only : int or None
        RADAR_SENSOR_ONLY: only plots and mono-radar rows of this sensor number.
    track_measurements_min : int
        TRACKS_MIN_MEASUR: minimum number of points of a track.
    kinds : tuple of str
        Kinds of track files to write.
    date : date or None
        First day of the recording.
    allow_missing : bool
        Whether tracks.txt or plots_ads.txt may be missing.
    profile : Profile
        Names and units of the dump.
    threads : int
        Threads that parse and write; the output does not depend on their number.
    """

    aircraft_max: int | None = None
    ads_measurements_min: int = 0
    sensor_only: int | None = None
    track_measurements_min: int = 1
    kinds: tuple[str, ...] = TRACK_KINDS
    date: dt.date | None = None
    allow_missing: bool = False
    profile: Profile = field(default_factory=Profile)
    threads: int = 2

    def settings(self) -> dict[str, object]:
        """Return the options that affect the output, for `report.json`."""
        return {
            "aircraft_max": self.aircraft_max,
            "ads_measurements_min": self.ads_measurements_min,
            "sensor_only": self.sensor_only,
            "track_measurements_min": self.track_measurements_min,
            "kinds": list(self.kinds),
            "date": None if self.date is None else self.date.isoformat(),
            "multiradar_source": self.profile.multiradar_source,
            "naming_tolerance_s": self.profile.naming_tolerance_s,
        }
