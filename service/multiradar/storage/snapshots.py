"""Snapshots beside the journal: files that are written whole, and checked before they are used.

A snapshot is a file of its own, and files of rows that later snapshots share with it:

=============================  =============================================================
File                           Content
=============================  =============================================================
``000000012345.snapshot``      the state after entry 12345, and the rows that belong to it
``history-0-8192-1a2b….rows``  rows of a table, first…end; the name has the start of its hash
=============================  =============================================================

Each has a line that states its format, the length of a header (8 octets, little endian), the header
as JSON, the arrays that it lists, and the SHA-256 of all that. Numbers are little endian. A file
gets its name when it is on disk.
"""

import contextlib
import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import SnapshotError
from multiradar.state import EncodedState

#: Version of the form of the files; incremented too when values get another meaning.
FORMAT_VERSION = 2
#: Snapshots that are kept.
KEPT = 2

_MAGIC = b"multiradar snapshot "
_LENGTH_OCTETS = 8
_DIGEST_OCTETS = 32
_SUFFIX, _ROWS_SUFFIX, _PARTIAL = ".snapshot", ".rows", ".partial"
_WRITE_OCTETS = 1 << 24


class RowFile(NamedTuple):
    """A file with rows of a table: their numbers, and the SHA-256 at its end."""

    name: str
    first: int
    end: int
    digest: str


class Position(NamedTuple):
    """An entry of the journal, and its digest, which covers all before it."""

    sequence: int
    digest: bytes


class Snapshot(NamedTuple):
    """A snapshot in memory.

    Attributes
    ----------
    position : Position
        Last entry of the journal that it covers.
    key : mapping of str to str
        What else must be the same when it is used.
    states : mapping of str to EncodedState
        States, by name. All have one list of arrays.
    tables : mapping of str to sequence of RowFile
        Files of the rows of each table, without a gap.
    """

    position: Position
    key: Mapping[str, str]
    states: Mapping[str, EncodedState]
    tables: Mapping[str, Sequence[RowFile]]


class SnapshotFolder:
    """The snapshots of a journal; one process writes them.

    Parameters
    ----------
    journal : Path
        The journal; the folder beside it is created with the first snapshot.
    """

    def __init__(self, journal: Path) -> None:
        # The journal is beside the file, not beside a link to it.
        journal = journal.resolve() if journal.is_symlink() else journal
        self.path = journal.with_name(f"{journal.name}-snapshots")
        # Files of rows that each snapshot needs, where that is known.
        self._needed: dict[str, frozenset[str]] = {}
        # Snapshots that cannot be used, whatever their number.
        self._rejected: set[str] = set()

    def files(self) -> list[Path]:
        """Return the snapshots, the newest first."""
        try:
            names = [name for name in os.listdir(self.path) if name.endswith(_SUFFIX)]
        except OSError:
            return []
        return [self.path / name for name in sorted(names, reverse=True)]

    def read_ahead(self) -> None:
        """Have the system read the newest snapshot and all rows from the disk meanwhile."""
        with contextlib.suppress(OSError):
            rows = [self.path / one for one in os.listdir(self.path) if one.endswith(_ROWS_SUFFIX)]
            for path in (*self.files()[:1], *rows):
                with path.open("rb") as stream:
                    os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_WILLNEED)

    def reject(self, path: Path) -> None:
        """Remove a snapshot, which cannot be used, when the next one is written."""
        self._rejected.add(path.name)

    def clear(self) -> None:
        """Remove all snapshots: the next start reads the whole journal."""
        for path in self.files():
            self.reject(path)
        self.tidy()

    def write_rows(self, table: str, first: int, rows: NDArray[Any]) -> RowFile:
        """Write rows of a table; `first` is the number of the first.

        Raises
        ------
        SnapshotError
            If it cannot be written; also by `write`.
        """
        end = first + len(rows)
        header = {"table": table, "first": first, "end": end}

        def name_of(digest: str) -> str:
            return f"{table}-{first}-{end}-{digest[:16]}{_ROWS_SUFFIX}"

        name, digest = self._write(name_of, header, [rows])
        return RowFile(name, first, end, digest)

    def write(self, snapshot: Snapshot) -> int:
        """Write a snapshot, and remove what no kept snapshot needs; return its octets."""
        sequence, digest = snapshot.position
        header = {
            "sequence": sequence,
            "digest": digest.hex(),
            "key": dict(snapshot.key),
            "states": {name: state.document for name, state in snapshot.states.items()},
            "tables": {name: list(files) for name, files in snapshot.tables.items()},
        }
        arrays = next(iter(snapshot.states.values())).arrays
        name, _ = self._write(lambda _: f"{sequence:012d}{_SUFFIX}", header, arrays)
        self._needed[name] = _names(snapshot)
        self._rejected.discard(name)
        self.tidy()
        return (self.path / name).stat().st_size

    def read(self, path: Path) -> Snapshot:
        """Read a snapshot.

        Raises
        ------
        SnapshotError
            If it is damaged, or of another format.
        """
        header, arrays = _read(path)
        try:
            return Snapshot(
                Position(int(header["sequence"]), bytes.fromhex(header["digest"])),
                {str(name): str(value) for name, value in header["key"].items()},
                {name: EncodedState(one, arrays) for name, one in header["states"].items()},
                {
                    name: [RowFile(*file) for file in files]
                    for name, files in header["tables"].items()
                },
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise SnapshotError(f"{path.name}: not a snapshot header") from error

    def read_rows(self, files: Sequence[RowFile]) -> NDArray[Any]:
        """Read the rows of a table, which cannot be changed in place; raises SnapshotError."""
        parts = []
        for file in files:
            path = self.path / Path(file.name).name
            header, (rows,) = _read(path, file.digest, copied=False)
            if (header["first"], header["end"]) != (file.first, file.end):
                raise SnapshotError(f"{file.name}: expected rows {file.first} to {file.end}")
            parts.append(rows)
        try:
            return joined_rows(parts)
        except ValueError as error:
            raise SnapshotError(f"{files[0].name} and those after it: {error}") from error

    # ---------------------------------------------------------------- inside

    def _write(
        self, name_of: Callable[[str], str], header: dict[str, Any], arrays: Sequence[NDArray[Any]]
    ) -> tuple[str, str]:
        partial = self.path / f"{os.getpid()}{_PARTIAL}"
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            digest = _write_synced(partial, header, arrays)
            name = name_of(digest)
            os.rename(partial, self.path / name)
            _sync_folder(self.path)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.unlink(partial)
            reason = error.strerror or str(error)
            raise SnapshotError(f"{self.path}: cannot be written: {reason}") from error
        return name, digest

    def tidy(self) -> None:
        """Remove what no kept snapshot needs."""
        needed: set[str] = set()
        usable = [path for path in self.files() if path.name not in self._rejected]
        for path in usable[:KEPT]:
            try:
                if path.name not in self._needed:
                    self._needed[path.name] = _names(self.read(path))
            except SnapshotError:
                # It cannot be used, and which rows belong to it is not known.
                continue
            needed |= {path.name, *self._needed[path.name]}
        own = (_SUFFIX, _ROWS_SUFFIX, _PARTIAL)
        with contextlib.suppress(OSError):
            for name in os.listdir(self.path):
                if name.endswith(own) and name not in needed:
                    self._needed.pop(name, None)
                    os.unlink(self.path / name)


def joined_rows(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return rows one after the other.

    Parts without any may be of another type. The columns of a sensor that was added, at the end of
    a field, are zero in the rows before.

    Raises
    ------
    ValueError
        If the types differ in something else.
    """
    given = [one for one in parts if len(one)] or parts[:1]
    if len(given) == 1:
        return given[0]
    if any(one.dtype != given[0].dtype for one in given):
        given = _widened(given)
    return np.concatenate(given)


def _widened(parts: Sequence[NDArray[Any]]) -> list[NDArray[Any]]:
    described = [[(*one, ())[:3] for one in part.dtype.descr] for part in parts]
    if len({tuple((name, kind, len(shape)) for name, kind, shape in one) for one in described}) > 1:
        raise ValueError("the rows are of different types")
    wide = [
        (fields[0][0], fields[0][1], tuple(map(max, *(shape for _, _, shape in fields))))
        for fields in zip(*described, strict=True)
    ]
    found = []
    for part, own in zip(parts, described, strict=True):
        rows = np.zeros(len(part), wide)
        for name, _, shape in own:
            rows[name][(slice(None), *map(slice, shape))] = part[name]
        found.append(rows)
    return found


def _names(snapshot: Snapshot) -> frozenset[str]:
    return frozenset(file.name for files in snapshot.tables.values() for file in files)


def _write_synced(path: Path, header: dict[str, Any], arrays: Sequence[NDArray[Any]]) -> str:
    little = [np.ascontiguousarray(one, one.dtype.newbyteorder("<")) for one in arrays]
    header["arrays"] = [[np.lib.format.dtype_to_descr(one.dtype), one.shape] for one in little]
    text = json.dumps(header).encode()
    whole = hashlib.sha256()
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    try:
        begin = _MAGIC + b"%d\n" % FORMAT_VERSION + len(text).to_bytes(_LENGTH_OCTETS, "little")
        octets: list[Any] = [one.reshape(-1).view(np.uint8).data for one in little if one.size]
        for part in (begin, text, *octets):
            whole.update(part)
            _write_all(file, part)
        _write_all(file, whole.digest())
        os.fsync(file)
    finally:
        os.close(file)
    return whole.hexdigest()


def _write_all(file: int, octets: Any) -> None:
    left = memoryview(octets)
    while left:
        left = left[os.write(file, left[:_WRITE_OCTETS]) :]


def _read(
    path: Path, digest: str | None = None, *, copied: bool = True
) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    try:
        octets = memoryview(path.read_bytes())
    except OSError as error:
        raise SnapshotError(f"{path.name}: {error.strerror}") from error
    begin = bytes(octets[:64]).partition(b"\n")[0]
    if not begin.startswith(_MAGIC):
        raise SnapshotError(f"{path.name}: damaged: no snapshot header at the start")
    if begin != _MAGIC + b"%d" % FORMAT_VERSION:
        version = begin[len(_MAGIC) :].decode("ascii", "replace")
        raise SnapshotError(f"{path.name}: expected format {FORMAT_VERSION}, was {version}")
    whole, found = octets[:-_DIGEST_OCTETS], octets[-_DIGEST_OCTETS:].hex()
    if hashlib.sha256(whole).hexdigest() != found or digest not in (None, found):
        raise SnapshotError(f"{path.name}: damaged: the SHA-256 does not match the content")
    try:
        return _parsed(whole[len(begin) + 1 :], copied=copied)
    except (KeyError, TypeError, ValueError) as error:
        raise SnapshotError(f"{path.name}: the header does not match the content") from error


def _parsed(octets: memoryview, *, copied: bool) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    place = _LENGTH_OCTETS + int.from_bytes(octets[:_LENGTH_OCTETS], "little")
    header = json.loads(bytes(octets[_LENGTH_OCTETS:place]))
    arrays = []
    for described, shape in header["arrays"]:
        kind = _dtype_of(described)
        size = math.prod(shape) * kind.itemsize
        array = np.frombuffer(octets[place : place + size], kind).reshape(shape)
        # A copy has its own memory, aligned and writable.
        arrays.append(array.copy() if copied else array)
        place += size
    if place != len(octets):
        raise ValueError("octets are left")
    return header, arrays


def _dtype_of(described: Any) -> np.dtype[Any]:
    # Shapes of fields are tuples, for which JSON has lists.
    fields: Any = described
    if not isinstance(described, str):
        fields = [(one[0], one[1], *map(tuple, one[2:])) for one in described]
    kind: np.dtype[Any] = np.lib.format.descr_to_dtype(fields)
    if kind.hasobject:
        raise ValueError("objects")
    # That of the machine: compiled functions know no other.
    return kind.newbyteorder("=")


def _sync_folder(path: Path) -> None:
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
