"""The heap of the C library returns what is unused."""

import ctypes
from pathlib import Path

import pytest

from multiradar.runtime import heap


def _resident_kb() -> int:
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))


def test_unused_memory_below_used_memory_is_returned() -> None:
    library = ctypes.CDLL(None)
    library.malloc.restype = ctypes.c_void_p
    library.malloc.argtypes = [ctypes.c_size_t]
    library.free.argtypes = [ctypes.c_void_p]
    # Pieces too small for a mapping of their own, the last of which stays in use.
    pieces = [library.malloc(64_000) for _ in range(1000)]
    for piece in pieces:
        ctypes.memset(piece, 1, 64_000)
    before = _resident_kb()
    for piece in pieces[:-1]:
        library.free(piece)
    heap.release_heap()
    assert _resident_kb() < before - 50_000
    library.free(pieces[-1])


def test_another_c_library_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda _name: object())
    heap.release_heap()
    heap.share_heap()
