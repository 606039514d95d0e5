"""What a user can choose about a conversion."""

import datetime as dt
from dataclasses import dataclass, field

from multiradar_converters.vid.profile import Profile

#: Kinds of track files: ADS-B tracks, the recording system's multiradar tracks, its mono-radar
#: tracks, radar plots that these name.
TRACK_KINDS = ("ads", "multiradar", "monoradar", "plots")


@dataclass(frozen=True)
class Options:
    """Choices; the defaults convert everything.

    Attributes
    ----------
    aircraft_max : int or None
        AZN_TRACKS_MAX: at most so many aircraft, those with most ADS-B reports.
    ads_measurements_min : int
        AZN_TRACKS_MIN_MEASUR: only aircraft with so many ADS-B reports.
    sensor_only : int or None
        RADAR_SENSOR_ONLY: only plots and mono-radar rows of this kind of sensor.
    track_measurements_min : int
        TRACKS_MIN_MEASUR: shorter tracks are not written.
    kinds : tuple of str
        Which kinds of track files to write.
    date : date or None
        The day of the recording.
    allow_missing : bool
        Whether tracks.txt or plots_ads.txt may be missing.
    profile : Profile
        What the recording calls things.
    threads : int
        Threads that parse and write; the output does not depend on it.
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
        """Return the choices that shape the output, for `report.json`."""
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
