"""A digest of all output, to compare two runs."""

import hashlib
from collections.abc import Sized
from typing import ClassVar

import numpy as np

from multiradar.state import Fields
from multiradar.tracking.columns import column_types, row_type, rows_of
from multiradar.tracking.outputs import EngineOutput, TrackUpdates

#: Octets of a block.
BLOCK_OCTETS = 1 << 23


class BlockDigest:
    """SHA-256 of octets by blocks: each is hashed after the digest of those before it.

    Of less than a block it is the SHA-256 of the octets. A plain SHA-256 could not be continued
    from a snapshot, because its state cannot be read.
    """

    STATE: ClassVar[Fields] = {"_before": bytes, "_last": bytes}

    def __init__(self) -> None:
        self._before = b""
        self._parts: list[bytes] = []
        self.restored()

    def update(self, octets: bytes) -> None:
        """Add octets."""
        while len(octets) >= self._room:
            self._digest.update(octets[: self._room])
            octets = octets[self._room :]
            self._before, self._parts = self._digest.digest(), []
            self.restored()
        if octets:
            self._digest.update(octets)
            self._parts.append(octets)
            self._room -= len(octets)

    def digest(self) -> bytes:
        """Return the digest of all octets so far."""
        return self._digest.digest()

    @property
    def _last(self) -> bytes:
        # The octets since the last full block.
        self._parts = [b"".join(self._parts)]
        return self._parts[0]

    @_last.setter
    def _last(self, octets: bytes) -> None:
        self._parts = [octets]

    def restored(self) -> None:
        """Hash the octets since the last full block again."""
        self._digest = hashlib.sha256(self._before + self._last)
        self._room = BLOCK_OCTETS - len(self._last)


class OutputDigest:
    """SHA-256 over every row of the output, in order; independent of the cuts between calls.

    Track updates, biases, track ends and transitions have separate digests, because their order
    within calls depends on the batches. The result is the digest of the four, and of the ground
    status of track updates that have one: few recordings do. Columns that repeat the measurements
    are not included.
    """

    STATE: ClassVar[Fields] = {
        "_updates": BlockDigest,
        "_biases": BlockDigest,
        "_ended": BlockDigest,
        "_transitions": BlockDigest,
        "_statuses": BlockDigest,
        "_has_statuses": bool,
    }

    def __init__(self) -> None:
        self._updates = BlockDigest()
        self._biases = BlockDigest()
        self._ended = BlockDigest()
        self._transitions = BlockDigest()
        self._statuses = BlockDigest()
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
).newbyteorder("<")
_STATUS_TYPE = row_type(TrackUpdates, ["sequence", _STATUS]).newbyteorder("<")


def _row_bytes(table: Sized, kind: np.dtype[np.void] | None = None) -> bytes:
    """Return the rows one after the other, each as its columns in little-endian order."""
    # Most calls of the engine have no rows of most tables.
    if not len(table):
        return b""
    return rows_of(table, kind or row_type(type(table)).newbyteorder("<")).tobytes()
