"""A digest of all output, to compare two runs."""

import hashlib

import numpy as np

from multiradar.tracking.columns import column_types, row_type, rows_of
from multiradar.tracking.outputs import EngineOutput, TrackUpdates


class OutputDigest:
    """SHA-256 over every row of the output, in order; independent of the cuts between calls.

    Track updates, biases, track ends and transitions have separate digests, because their order
    within calls depends on the batches. The result is the digest of the four, and of the ground
    status of track updates that have one: few recordings do. Columns that repeat the measurements
    are not included.
    """

    def __init__(self) -> None:
        self._updates = hashlib.sha256()
        self._biases = hashlib.sha256()
        self._ended = hashlib.sha256()
        self._transitions = hashlib.sha256()
        self._statuses = hashlib.sha256()
        self._has_statuses = False

    def add(self, output: EngineOutput) -> None:
        """Add the rows of one call of the engine."""
        self._updates.update(_row_bytes(output.updates, _UPDATE_TYPE))
        if (output.updates.on_ground >= 0).any():
            known = rows_of(output.updates, _STATUS_TYPE)
            self._statuses.update(known[known[_STATUS] >= 0].tobytes())
            self._has_statuses = True
        self._biases.update(_row_bytes(output.biases))
        self._ended.update(_row_bytes(output.ended))
        self._transitions.update(_row_bytes(output.transitions))

    def hexdigest(self) -> str:
        """Return the digest of all rows so far, 64 hexadecimal digits."""
        parts = [self._updates, self._biases, self._ended, self._transitions]
        parts += [self._statuses] if self._has_statuses else []
        return hashlib.sha256(b"".join(part.digest() for part in parts)).hexdigest()


_STATUS = "on_ground"
# Column of the updates that repeats the measurement.
_MEASURED = "measured_mode_s_address"
_UPDATE_TYPE = row_type(
    TrackUpdates,
    [name for name in column_types(TrackUpdates) if name not in (_STATUS, _MEASURED)],
)
_STATUS_TYPE = row_type(TrackUpdates, ["sequence", _STATUS]).newbyteorder("<")


def _row_bytes(table: object, kind: np.dtype[np.void] | None = None) -> bytes:
    """Return the rows one after the other, each as its columns in little-endian order."""
    wanted = row_type(type(table)) if kind is None else kind
    return rows_of(table, wanted.newbyteorder("<")).tobytes()
