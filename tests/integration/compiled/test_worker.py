"""Worker processes of compilation: they answer every request, and end with the command."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

WORKER = [sys.executable, "-P", "-m", "multiradar_compiled.worker"]
LOCATE = "multiradar.geodesy._kernels:geodetic_to_plane"


def test_what_cannot_be_compiled_is_named_and_the_next_is_compiled() -> None:
    requests = [
        {"kernel": "multiradar.nosuch:kernel", "arguments": []},
        {"kernel": LOCATE, "arguments": ["text"]},
        {"kernel": LOCATE, "arguments": ["float64[1C]", "float64", "float64"]},
    ]
    lines = "".join(json.dumps(one) + "\n" for one in requests)
    line = [*WORKER, str(os.getpid())]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as one:
        answers, _ = one.communicate(lines, timeout=WAIT_TIMEOUT_S)
    first, second, third = answers.splitlines()
    assert first.startswith("multiradar.nosuch:kernel: ModuleNotFoundError: ")
    assert second.startswith(f"{LOCATE}: ValueError: ")
    assert third == ""


def test_a_worker_ends_with_its_command(tmp_path: Path) -> None:
    """The command is killed while it compiles; the end of its requests is noticed much later."""
    pid_file = tmp_path / "worker"
    reader, writer = os.pipe()
    code = (
        "import os, pathlib, subprocess, threading\n"
        f"line = [*{WORKER!r}, str(os.getpid())]\n"
        f"one = subprocess.Popen(line, stdin={reader}, stdout=subprocess.PIPE)\n"
        f"pathlib.Path({str(pid_file)!r}).write_text(str(one.pid))\n"
        "threading.Event().wait()\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], pass_fds=(reader,)) as command:
        wait_until(lambda: pid_file.exists() and pid_file.read_text(), "the worker")
        command.send_signal(signal.SIGKILL)
    worker = Path("/proc") / pid_file.read_text()
    wait_until(lambda: state_of(worker) == "Z", "the end of the worker")
    os.close(reader)
    os.close(writer)


def state_of(process: Path) -> str:
    """The state of a process, Z when it has ended."""
    try:
        return (process / "stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return "Z"
