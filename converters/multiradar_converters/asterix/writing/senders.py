"""Who sends our own records, and when."""

from dataclasses import dataclass

from multiradar_converters.asterix.writing.encoding import Records

DAY_S = 86_400.0
#: Resolution of times of day.
TICKS_PER_SECOND = 128


@dataclass(frozen=True)
class Sender:
    """Who sends: items 010 and 015.

    Attributes
    ----------
    sac, sic : int
        Area code and identification code.
    service : int
        Service identification.
    """

    sac: int
    sic: int
    service: int

    def sign(self, records: Records) -> None:
        """Enter it in records."""
        records.put("010", {"SAC": self.sac, "SIC": self.sic})
        records.put("015", self.service)


def ticks_of_day(time_s: float) -> int:
    """Return the time of day in 1/128 s; what rounds to midnight is 0."""
    return round(time_s % DAY_S * TICKS_PER_SECOND) % round(DAY_S * TICKS_PER_SECOND)
