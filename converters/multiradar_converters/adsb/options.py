"""Options of a conversion."""

import datetime as dt
from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """Options; the defaults detect as much as possible.

    Attributes
    ----------
    date : date or None
        First day of recordings without dates.
    utc_offset_h : float
        Local time of BaseStation messages minus UTC, h.
    """

    date: dt.date | None = None
    utc_offset_h: float = 0.0

    def settings(self) -> dict[str, object]:
        """Return the options that affect the output, for `report.json`."""
        settings: dict[str, object] = {"date": None if self.date is None else self.date.isoformat()}
        return settings | ({"utc_offset_h": self.utc_offset_h} if self.utc_offset_h else {})
