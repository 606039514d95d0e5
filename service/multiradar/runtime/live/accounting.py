"""Everything that was read is accounted for: read = accepted + duplicate + rejected."""

from dataclasses import dataclass

from multiradar.errors import PipelineError


@dataclass(slots=True)
class Accounting:
    """Rows by what became of them; owned by the writer of the journal, read by anyone.

    `accepted` and `rejected` come from the journal and survive a restart; `duplicate` counts since
    the start.
    """

    read: int = 0
    accepted: int = 0
    duplicate: int = 0
    rejected: int = 0

    def resume(self, accepted: int, rejected: int) -> None:
        """Begin with what the journal holds."""
        self.read = accepted + rejected
        self.accepted = accepted
        self.duplicate = 0
        self.rejected = rejected

    def check(self) -> None:
        """Compare both sides.

        Raises
        ------
        PipelineError
            If a row is missing, or counted twice: our own mistake, and no reason to go on.
        """
        if self.read != self.accepted + self.duplicate + self.rejected:
            raise PipelineError(
                f"rows are not accounted for: read {self.read}, accepted {self.accepted}, "
                f"duplicate {self.duplicate}, rejected {self.rejected}"
            )
