"""Sender and time of day of written records."""

from dataclasses import dataclass

from multiradar_converters.asterix.writing.encoding import Records

DAY_S = 86_400.0
#: Resolution of times of day.
TICKS_PER_SECOND = 128


@dataclass(frozen=True)
class Sender:
    """Sender: items 010 and 015.

    Attributes
    ----------
    sac, sic : int
        SAC and SIC.
    service : int
        Service identification.
    """

    sac: int
    sic: int
    service: int

    def sign(self, records: Records) -> None:
        """Fill the items in records."""
        records.put("010", {"SAC": self.sac, "SIC": self.sic})
        records.put("015", self.service)


def ticks_of_day(time_s: float) -> int:
    """Return the time of day in 1/128 s; 0 if rounded to midnight."""
    return round(time_s % DAY_S * TICKS_PER_SECOND) % round(DAY_S * TICKS_PER_SECOND)
