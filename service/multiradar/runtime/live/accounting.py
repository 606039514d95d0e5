"""Row accounting: read = accepted + duplicate + rejected."""

from dataclasses import dataclass

from multiradar.errors import PipelineError
from multiradar.storage.entries import JournalCounts


@dataclass(slots=True)
class Accounting:
    """Rows by outcome; written by the journal writer, read by any thread.

    `accepted` and `rejected` come from the journal and survive a restart; `duplicate` counts from
    the start, as does `internal_errors`: messages in the journal whose alarms or diagnosis failed.
    """

    read: int = 0
    accepted: int = 0
    duplicate: int = 0
    rejected: int = 0
    internal_errors: int = 0

    def resume(self, counts: JournalCounts) -> JournalCounts:
        """Start with the counts of the journal, and return them."""
        self.read = counts.accepted + counts.rejected
        self.accepted = counts.accepted
        self.duplicate = 0
        self.rejected = counts.rejected
        return counts

    def check(self) -> None:
        """Check the balance.

        Raises
        ------
        PipelineError
            If a row is missing or counted twice: a bug in multiradar.
        """
        if self.read != self.accepted + self.duplicate + self.rejected:
            raise PipelineError(
                f"row counts do not add up: read {self.read}, accepted {self.accepted}, "
                f"duplicate {self.duplicate}, rejected {self.rejected}"
            )
