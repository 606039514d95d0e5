"""What a user can choose about a conversion."""

import datetime as dt
from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """Choices; the defaults find out what they can.

    Attributes
    ----------
    date : date or None
        The day on which recordings without dates begin.
    """

    date: dt.date | None = None

    def settings(self) -> dict[str, object]:
        """Return the choices that shape the output, for `report.json`."""
        return {"date": None if self.date is None else self.date.isoformat()}
