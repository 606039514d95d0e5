"""The virtual disk: files of the journal whose writes may fail, tear, and be lost before a sync.

A layer above the file system of SQLite (https://www.sqlite.org/vfs.html) sees each write and sync
of the journal; what Python writes itself, its tip and snapshots, passes a replacement of `os`. The
real files, in memory where possible, hold what the process sees; beside them the layer keeps what a
power failure leaves.
"""

import _sqlite3
import ctypes
import errno
import os
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import CFUNCTYPE, POINTER, c_char_p, c_int, c_int64, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from multiradar.storage import snapshots
from multiradar.storage.sqlite import sqlite_file, tip

#: Results of SQLite.
IOERR, FULL, IOERR_READ, IOERR_FSYNC = 10, 13, 266, 1034
#: A write tears at these boundaries.
SECTOR_BYTES = 512

_CLOSE = CFUNCTYPE(c_int, c_void_p)
_TRANSFER = CFUNCTYPE(c_int, c_void_p, c_void_p, c_int, c_int64)
_TRUNCATE = CFUNCTYPE(c_int, c_void_p, c_int64)
_SYNC = CFUNCTYPE(c_int, c_void_p, c_int)
_OPEN = CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_int, POINTER(c_int))
_DELETE = CFUNCTYPE(c_int, c_void_p, c_char_p, c_int)
_RANDOMNESS = CFUNCTYPE(c_int, c_void_p, c_int, c_void_p)


class _Methods(ctypes.Structure):
    _fields_ = (
        ("version", c_int),
        ("close", _CLOSE),
        ("read", _TRANSFER),
        ("write", _TRANSFER),
        ("truncate", _TRUNCATE),
        ("sync", _SYNC),
        *((f"other_{number}", c_void_p) for number in range(13)),
    )


class _Layer(ctypes.Structure):
    _fields_ = (
        ("version", c_int),
        ("file_bytes", c_int),
        ("path_bytes_max", c_int),
        ("following", c_void_p),
        ("name", c_char_p),
        ("data", c_void_p),
        ("open", _OPEN),
        ("delete", _DELETE),
        *((f"other_{number}", c_void_p) for number in range(6)),
        ("randomness", _RANDOMNESS),
        *((f"late_{number}", c_void_p) for number in range(7)),
    )


@dataclass(slots=True)
class _Content:
    # What a power failure leaves of a file, and the writes since its last sync: place and octets,
    # or a length to which it was cut.
    durable: bytearray
    pending: list[tuple[int, bytes | None]] = field(default_factory=list)
    synced: bool = False

    def write_all(self) -> None:
        for place, octets in self.pending:
            self.apply(place, octets)
        self.pending.clear()

    def apply(self, place: int, octets: bytes | None) -> None:
        if octets is None:
            del self.durable[place:]
            return
        if len(self.durable) < place:
            self.durable.extend(bytes(place - len(self.durable)))
        self.durable[place : place + len(octets)] = octets


class VirtualDisk:
    """The disk of one process, from its start to its end.

    Parameters
    ----------
    folder : Path
        An empty folder.
    random : Random
        Draws what is lost and how writes tear.
    image : mapping of str to bytes
        Files at the start.

    Attributes
    ----------
    dead : bool
        The process has been killed: nothing reaches the disk any more.
    boundaries : int
        Writes, syncs, cuts and removals so far.
    kill_at : int or None
        The process is killed at this boundary.
    on_kill : callable
        Called then.
    full : bool
        Writes fail for want of space.
    failing_syncs : int
        So many of the next ones fail.
    """

    def __init__(self, folder: Path, random: random.Random, image: dict[str, bytes]) -> None:
        self._folder = folder
        self._random = random
        self._files: dict[str, _Content] = {}
        self._removed: dict[str, _Content] = {}
        self.dead = False
        self.boundaries = 0
        self.kill_at: int | None = None
        self.on_kill: Callable[[], None] = lambda: None
        self.full = False
        self.failing_syncs = self._failing_reads = 0
        #: Whether a read may fail: only then the layer sees them.
        self.watches_reads = False
        #: Kinds of faults that have occurred.
        self.faulted: set[str] = set()
        for name, content in image.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(content)
            self._files[name] = _Content(bytearray(content))
        _layer().disks[str(folder)] = self

    def image(self, *, power_lost: bool) -> dict[str, bytes]:
        """Return the files that are left; after a power failure without some unsynced writes."""
        found: dict[str, bytes] = {}
        if power_lost:
            for name, content in self._removed.items():
                # The removal itself may be lost.
                if name not in self._files and self._random.random() < 0.5:
                    found[name] = bytes(content.durable)
        for name, content in self._files.items():
            left = _Content(bytearray(content.durable), list(content.pending))
            if power_lost:
                self._write_some(left)
            else:
                left.write_all()
            found[name] = bytes(left.durable)
        return found

    @property
    def failing_reads(self) -> int:
        """So many of the next reads fail."""
        return self._failing_reads

    @failing_reads.setter
    def failing_reads(self, number: int) -> None:
        self._failing_reads = number
        if number and not self.watches_reads:
            self.watches_reads = True
            _layer().watch_reads(self)

    @contextmanager
    def sound(self) -> Iterator[None]:
        """Have no faults for a while."""
        names = ("kill_at", "full", "failing_syncs", "failing_reads")
        before = {name: getattr(self, name) for name in names}
        self.kill_at, self.full, self.failing_syncs, self.failing_reads = None, False, 0, 0
        yield
        for name, value in before.items():
            setattr(self, name, value)

    def close(self) -> None:
        """Leave the folder."""
        self.dead = True
        _layer().disks.pop(str(self._folder), None)

    def _write_some(self, content: _Content) -> None:
        for place, octets in content.pending:
            drawn = self._random.random()
            if drawn < 0.4:
                content.apply(place, octets)
            elif drawn < 0.6 and octets is not None:
                for start in range(0, len(octets), SECTOR_BYTES):
                    if self._random.random() < 0.5:
                        content.apply(place + start, octets[start : start + SECTOR_BYTES])
        content.pending.clear()

    # ---------------------------------------------------------------- calls of SQLite and Python

    def opened(self, name: str) -> None:
        """Note that a file exists."""
        if name not in self._files:
            self._files[name] = _Content(bytearray())

    def read_fails(self) -> bool:
        """Return whether this read fails."""
        if self.failing_reads:
            self.failing_reads -= 1
            self.faulted.add("failing_reads")
            return True
        return False

    def write(self, name: str, place: int, octets: bytes | None) -> int:
        """Note a write, or a cut; return the result, 0 if it is to be done."""
        if self._dies():
            if octets is not None:
                # The kernel takes whole sectors.
                ends = [end for end in range(place, place + len(octets)) if not end % SECTOR_BYTES]
                done = self._random.choice([0, *(end - place for end in ends), len(octets)])
                self._files[name].pending.append((place, octets[:done]))
                # Another process on this disk reads them.
                with (self._folder / name).open("r+b") as stream:
                    os.pwrite(stream.fileno(), octets[:done], place)
            self._die()
        if self.dead:
            return IOERR
        if self.full and octets is not None:
            self.faulted.add("full")
            return FULL
        self._files[name].pending.append((place, octets))
        return 0

    def sync(self, name: str) -> int:
        """Note a sync; return the result."""
        if self._dies():
            self._die()
        if self.dead:
            return IOERR
        content = self._files[name]
        if self.failing_syncs:
            self.failing_syncs -= 1
            self.faulted.add("failing_syncs")
            # The system loses what it could not write, and later syncs do not write it.
            self._write_some(content)
            return IOERR_FSYNC
        if not content.synced:
            # SQLite syncs the folder with a new file, and with it all removals before.
            content.synced = True
            self._removed.clear()
        content.write_all()
        return 0

    def removed(self, name: str) -> int:
        """Note a removal; return the result."""
        if self._dies():
            self._die()
        if self.dead:
            return IOERR
        if name in self._files:
            self._removed[name] = self._files.pop(name)
        return 0

    def renamed(self, name: str, new: str) -> int:
        """Note a new name of a file; return the result."""
        if self._dies():
            self._die()
        if self.dead:
            return IOERR
        self._files[new] = self._files.pop(name)
        return 0

    def _dies(self) -> bool:
        self.boundaries += 1
        return not self.dead and self.kill_at is not None and self.boundaries >= self.kill_at

    def _die(self) -> None:
        self.on_kill()
        self.dead = True


class _SqliteLayer:
    # The layer, registered once as the default of SQLite. Files outside of virtual disks are
    # those of the layer below.

    def __init__(self) -> None:
        self.disks: dict[str, VirtualDisk] = {}
        self._open: dict[int, tuple[VirtualDisk, str]] = {}
        # Those of the layer below by their address, and of this layer, without and with reads.
        self._methods: dict[int, tuple[_Methods, _Methods, _Methods]] = {}
        self._random = random.Random(0)
        library = ctypes.CDLL(_sqlite3.__file__)
        find, register = library.sqlite3_vfs_find, library.sqlite3_vfs_register
        find.restype, find.argtypes = POINTER(_Layer), [c_char_p]
        register.argtypes = [POINTER(_Layer), c_int]
        self._below = find(None).contents
        self._layer = _Layer.from_buffer_copy(self._below)
        self._layer.name = b"simulated"
        self._layer.open = _OPEN(self._opened)
        self._layer.delete = _DELETE(self._removed)
        self._layer.randomness = _RANDOMNESS(self._drawn)
        register(ctypes.byref(self._layer), 1)

    def disk_of(self, path: str) -> tuple[VirtualDisk, str] | None:
        folder, _, name = path.rpartition("/")
        if folder not in self.disks:
            # Snapshots are in a folder of their own.
            folder, _, inner = folder.rpartition("/")
            name = f"{inner}/{name}"
        disk = self.disks.get(folder)
        return None if disk is None else (disk, name)

    def _opened(self, layer: int, path: int, file: int, flags: int, out: object) -> int:
        result = self._below.open(layer, path, file, flags, out)
        found = self.disk_of(ctypes.string_at(path).decode()) if path and not result else None
        if found is not None:
            found[0].opened(found[1])
            self._open[file] = found
            self._patch(file, watches_reads=found[0].watches_reads)
        return int(result)

    def watch_reads(self, disk: VirtualDisk) -> None:
        for file, (one, _) in self._open.items():
            if one is disk:
                self._patch(file, watches_reads=True)

    def _patch(self, file: int, *, watches_reads: bool) -> None:
        methods = c_void_p.from_address(file)
        address = methods.value
        assert address is not None
        for below, *patched in self._methods.values():
            if address in map(ctypes.addressof, patched):
                address = ctypes.addressof(below)
        if address not in self._methods:
            below = _Methods.from_address(address)
            own = _Methods.from_buffer_copy(below)
            own.version = 2  # without memory-mapped reads
            own.close, own.truncate = _CLOSE(self._closer(below)), _TRUNCATE(self._cutter(below))
            own.write, own.sync = _TRANSFER(self._writer(below)), _SYNC(self._syncer(below))
            reading = _Methods.from_buffer_copy(own)
            reading.read = _TRANSFER(self._reader(below))
            # The copy shares the callbacks, which the first one keeps.
            self._methods[address] = below, own, reading
        methods.value = ctypes.addressof(self._methods[address][1 + watches_reads])

    def _closer(self, below: _Methods) -> Callable[[int], int]:
        def close(file: int) -> int:
            self._open.pop(file, None)
            return int(below.close(file))

        return close

    def _reader(self, below: _Methods) -> Callable[[int, int, int, int], int]:
        def read(file: int, into: int, size: int, place: int) -> int:
            if self._open[file][0].read_fails():
                return IOERR_READ
            return int(below.read(file, into, size, place))

        return read

    def _writer(self, below: _Methods) -> Callable[[int, int, int, int], int]:
        def write(file: int, octets: int, size: int, place: int) -> int:
            disk, name = self._open[file]
            failed = disk.write(name, place, ctypes.string_at(octets, size))
            return failed or int(below.write(file, octets, size, place))

        return write

    def _cutter(self, below: _Methods) -> Callable[[int, int], int]:
        def cut(file: int, size: int) -> int:
            disk, name = self._open[file]
            return disk.write(name, size, None) or int(below.truncate(file, size))

        return cut

    def _syncer(self, below: _Methods) -> Callable[[int, int], int]:
        def sync(file: int, flags: int) -> int:
            disk, name = self._open[file]
            return disk.sync(name) or int(below.sync(file, flags))

        return sync

    def _removed(self, layer: int, path: bytes, sync_folder: int) -> int:
        found = self.disk_of(path.decode())
        failed = found[0].removed(found[1]) if found is not None else 0
        return failed or int(self._below.delete(layer, path, sync_folder))

    def _drawn(self, _layer: int, size: int, into: int) -> int:
        ctypes.memmove(into, self._random.randbytes(size), size)
        return size


class _FileSystem:
    """The module `os` for what the service writes beside SQLite: its tip, and snapshots."""

    def __init__(self) -> None:
        self._open: dict[int, tuple[VirtualDisk, str]] = {}

    def open(self, path: Path, flags: int, mode: int = 0o777) -> int:
        """Open a file; one of a virtual disk is followed."""
        file = os.open(path, flags, mode)
        found = _layer().disk_of(str(path))
        if found is not None and not os.path.isdir(path):
            found[0].opened(found[1])
            self._open[file] = found
        return file

    def write(self, file: int, octets: bytes) -> int:
        """Write at the end of what was written."""
        self.pwrite(file, bytes(octets), os.lseek(file, 0, os.SEEK_CUR))
        return os.lseek(file, len(octets), os.SEEK_CUR) and len(octets)

    def rename(self, path: Path, new: Path) -> None:
        """Rename a file."""
        found, other = _layer().disk_of(str(path)), _layer().disk_of(str(new))
        if found is not None and other is not None:
            _require(found[0].renamed(found[1], other[1]))
        os.rename(path, new)

    def unlink(self, path: Path) -> None:
        """Remove a file."""
        found = _layer().disk_of(str(path))
        if found is not None:
            _require(found[0].removed(found[1]))
        os.unlink(path)

    def pwrite(self, file: int, octets: bytes, place: int) -> int:
        """Write."""
        self._checked(file, lambda disk, name: disk.write(name, place, octets))
        return os.pwrite(file, octets, place)

    def ftruncate(self, file: int, size: int) -> None:
        """Cut."""
        self._checked(file, lambda disk, name: disk.write(name, size, None))
        os.ftruncate(file, size)

    def fsync(self, file: int) -> None:
        """Sync."""
        self._checked(file, lambda disk, name: disk.sync(name))

    fdatasync = fsync

    def close(self, file: int) -> None:
        """Close."""
        self._open.pop(file, None)
        os.close(file)

    def _checked(self, file: int, call: Callable[[VirtualDisk, str], int]) -> None:
        _require(call(*self._open[file]) if file in self._open else 0)

    def __getattr__(self, name: str) -> Any:
        return getattr(os, name)


def _require(result: int) -> None:
    if result:
        number = errno.ENOSPC if result == FULL else errno.EIO
        raise OSError(number, os.strerror(number))


_installed: list[_SqliteLayer] = []


def _layer() -> _SqliteLayer:
    if not _installed:
        _installed.append(_SqliteLayer())
        files: Any = _FileSystem()
        tip.os = sqlite_file.os = snapshots.os = files  # type: ignore[attr-defined]
    return _installed[0]


def draw_from(seed: int) -> None:
    """Make what SQLite draws, such as the salt of the write-ahead log, a function of a seed."""
    _layer()._random.seed(seed)
