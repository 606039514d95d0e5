"""A digest of all output, to compare two runs."""

import hashlib

from multiradar.tracking.columns import row_type, rows_of
from multiradar.tracking.outputs import EngineOutput

# Column of the updates that repeats the measurement.
_MEASURED = "measured_mode_s_address"


class OutputDigest:
    """SHA-256 over every row of the output, in order; independent of the cuts between calls.

    Track updates, biases, track ends and transitions have separate digests, because their order
    within calls depends on the batches. The result is the digest of the four. Columns that repeat
    the measurements are not included.
    """

    def __init__(self) -> None:
        self._updates = hashlib.sha256()
        self._biases = hashlib.sha256()
        self._ended = hashlib.sha256()
        self._transitions = hashlib.sha256()

    def add(self, output: EngineOutput) -> None:
        """Add the rows of one call of the engine."""
        self._updates.update(_row_bytes(output.updates))
        self._biases.update(_row_bytes(output.biases))
        self._ended.update(_row_bytes(output.ended))
        self._transitions.update(_row_bytes(output.transitions))

    def hexdigest(self) -> str:
        """Return the digest of all rows so far, 64 hexadecimal digits."""
        parts = (self._updates, self._biases, self._ended, self._transitions)
        return hashlib.sha256(b"".join(part.digest() for part in parts)).hexdigest()


def _row_bytes(table: object) -> bytes:
    """Return the rows one after the other, each as its columns in little-endian order."""
    columns = row_type(type(table)).names or ()
    kind = row_type(type(table), [name for name in columns if name != _MEASURED])
    return rows_of(table, kind.newbyteorder("<")).tobytes()
