"""Ahead-of-time compilation: each missing kernel once, also with other workers and commands."""

import fcntl
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from multiradar_compiled import ahead
from multiradar_compiled.ahead import compile_ahead
from multiradar_compiled.kernel_list import TypedKernel

KERNELS = [TypedKernel(f"package.module:kernel_{i}", ("int64",)) for i in range(6)]
#: Workers that log requests and answer by the name of the kernel.
WORKER = """
import json, os, sys
for line in sys.stdin:
    kernel = json.loads(line)["kernel"]
    with open(sys.argv[1], "a") as log:
        log.write(kernel + "\\n")
    if kernel.endswith("_dies"):
        os._exit(1)
    print("TypeError: no" if kernel.endswith("_fails") else "", flush=True)
"""


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    log = tmp_path / "asked"
    log.touch()

    def start() -> "subprocess.Popen[str]":
        command = [sys.executable, "-c", WORKER, str(log)]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    monkeypatch.setattr(ahead, "_start_worker", start)
    monkeypatch.setattr(ahead, "kernel_folder", lambda: tmp_path)
    return log


def nothing(_done: int, _total: int) -> None:
    pass


def test_each_missing_kernel_is_compiled_and_then_cached(asked: Path) -> None:
    seen: list[tuple[int, int]] = []
    assert compile_ahead(KERNELS, lambda done, total: seen.append((done, total))) == 6
    assert sorted(asked.read_text().split()) == [one.kernel for one in KERNELS]
    assert seen[-1] == (6, 6)
    seen.clear()
    assert compile_ahead(KERNELS, lambda done, total: seen.append((done, total))) == 0
    assert seen == []
    assert len(asked.read_text().split()) == 6


@pytest.mark.slow
def test_only_what_is_missing_is_compiled(asked: Path) -> None:
    compile_ahead(KERNELS[:4], nothing)
    asked.write_text("")
    assert compile_ahead(KERNELS, nothing) == 2
    assert sorted(asked.read_text().split()) == [one.kernel for one in KERNELS[4:]]


@pytest.mark.slow
def test_other_types_of_arguments_are_another_kernel(asked: Path) -> None:
    compile_ahead(KERNELS[:1], nothing)
    assert compile_ahead([TypedKernel(KERNELS[0].kernel, ("float64",))], nothing) == 1


@pytest.mark.slow
def test_a_kernel_that_fails_stops_no_other_and_is_tried_again(asked: Path) -> None:
    wanted = [TypedKernel("package.module:kernel_fails", ()), *KERNELS]
    seen: list[tuple[int, int]] = []
    compile_ahead(wanted, lambda done, total: seen.append((done, total)))
    assert seen[-1] == (6, 7)
    assert compile_ahead(wanted, nothing) == 1


def test_a_worker_that_dies_leaves_the_rest_to_the_others(
    asked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _pid: {0, 1})
    wanted = [TypedKernel("package.module:kernel_dies", ()), *KERNELS]
    compile_ahead(wanted, nothing)
    assert sorted(asked.read_text().split()) == [one.kernel for one in (*KERNELS, wanted[0])]


def test_compilation_ends_when_all_workers_die(asked: Path) -> None:
    wanted = [TypedKernel(f"package.module:kernel_{i}_dies", ()) for i in range(20)]
    assert compile_ahead(wanted, nothing) == 20


def test_a_command_waits_while_another_one_compiles(asked: Path) -> None:
    """Kernels compiled by the other command are not compiled again."""
    marks = asked.parent / "compiled"
    marks.mkdir()
    waiting = threading.Event()

    def on_progress(done: int, total: int) -> None:
        assert (done, total) in {(0, 6), (6, 6)}
        waiting.set()

    with (asked.parent / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        thread = threading.Thread(target=compile_ahead, args=(KERNELS, on_progress))
        thread.start()
        waiting.wait()
        assert asked.read_text() == ""
        for one in KERNELS:
            ahead._mark(marks, one).touch()
        thread.join()
    assert asked.read_text() == ""


@pytest.mark.slow
def test_what_the_other_command_did_not_compile_is_compiled_after_it(asked: Path) -> None:
    waiting = threading.Event()
    with (asked.parent / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        thread = threading.Thread(
            target=compile_ahead, args=(KERNELS, lambda _done, _total: waiting.set())
        )
        thread.start()
        waiting.wait()
        assert asked.read_text() == ""
    thread.join()
    assert sorted(asked.read_text().split()) == [one.kernel for one in KERNELS]


def test_without_a_folder_nothing_is_compiled_ahead(
    asked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ahead, "kernel_folder", lambda: None)
    assert compile_ahead(KERNELS, nothing) == 0


def test_with_compilation_switched_off_nothing_is_compiled(
    asked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert compile_ahead(KERNELS, nothing) == 0
    assert asked.read_text() == ""
