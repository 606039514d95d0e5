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
    """

    date: dt.date | None = None

    def settings(self) -> dict[str, object]:
        """Return the options that affect the output, for `report.json`."""
        return {"date": None if self.date is None else self.date.isoformat()}
