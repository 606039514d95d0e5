"""A folder in which the programs of a page of the documents run."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

#: Width of the tables that commands print.
COLUMNS = 110
SERVICE = "127.0.0.1:8321"
TIMEOUT_S = 4 * 3600.0

#: Runs a program of the page to its end: its command line, its folder and its environment.
Runner = Callable[[Sequence[str], Path, Mapping[str, str]], "subprocess.CompletedProcess[str]"]


def in_process(
    line: Sequence[str], folder: Path, environment: Mapping[str, str]
) -> "subprocess.CompletedProcess[str]":
    """Run a program in a process that starts from nothing, as its reader does."""
    return subprocess.run(
        _interpreted(line), cwd=folder, env=environment, text=True, capture_output=True,
        timeout=TIMEOUT_S, check=False,
    )  # fmt: skip


class Workspace:
    """A folder in which the commands of a page run.

    Parameters
    ----------
    root : Path
        The repository.
    run : Runner
        Runs the programs, except the service.
    """

    def __init__(self, root: Path, run: Runner) -> None:
        self._run_program = run
        self._folder = Path(tempfile.mkdtemp(prefix="multiradar-documents-"))
        for name in ("examples", "docs", "deploy", "validation"):
            (self._folder / name).symlink_to(root / name)
        self._outputs: dict[str, str] = {}
        self._service: subprocess.Popen[str] | None = None
        self._http = ""

    def __enter__(self) -> "Workspace":
        return self

    def __exit__(self, *_: object) -> None:
        if self._service is not None:
            self._service.terminate()
            self._service.communicate()
        shutil.rmtree(self._folder)

    def output(self, command: str) -> str:
        """Return the output of a command; equal command lines run only once.

        Raises
        ------
        RuntimeError
            It failed.
        """
        first = shlex.split(command)[0]
        # Replays run again each time.
        if command not in self._outputs or first == "curl" or " replay " in command:
            self._outputs[command] = self._run(command)
        return self._outputs[command]

    def _run(self, command: str) -> str:
        line = shlex.split(command)
        if line[:2] == ["multiradar", "serve"]:
            return self._serve(line[1:])
        if line[0] == "curl":
            address = line[-1].replace(SERVICE, self._http)
            with urllib.request.urlopen(address, timeout=TIMEOUT_S) as answer:
                return str(answer.read().decode())
        if line[:2] == ["multiradar", "replay"] and self._service is not None:
            line += ["--to", f"http://{self._http}"]
        done = self._run_program(line, self._folder, environment())
        if done.returncode != 0:
            raise RuntimeError(f"{command}: status {done.returncode}: {done.stderr[-2000:]}")
        return done.stdout

    def _serve(self, line: Sequence[str]) -> str:
        ports = ["--port", "0", "--zenoh-listen", "tcp/127.0.0.1:0"]
        self._service = subprocess.Popen(
            _interpreted(["multiradar", *line, *ports]), cwd=self._folder, env=environment(),
            text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        assert self._service.stdout is not None
        said = self._service.stdout.readline()
        address = re.search(r"http://(\S+)", said)
        if address is None:
            raise RuntimeError(f"the service did not start: {said!r}")
        self._http = address[1]
        return said


def _interpreted(line: Sequence[str]) -> list[str]:
    programs = {"multiradar": ["-m", "multiradar"], "python": []}
    return [sys.executable, *programs[line[0]], *line[1:]]


def environment() -> dict[str, str]:
    """Return the environment of programs: no settings of the project, and the width of tables."""
    kept = {name: value for name, value in os.environ.items() if "MULTIRADAR_" not in name}
    return {**kept, "COLUMNS": str(COLUMNS), "NO_COLOR": "1"}
