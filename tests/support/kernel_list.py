"""Writes the list of kernels that commands compile in advance.

::

    make kernel-list                                # compiles everything, 10 minutes
    make kernel-list KERNEL_LIST_OPTIONS=--check    # what the list lacks or need not have

Every command of `runs` is run as a user would run it. What it calls from Python, with the types of
the arguments, is what its purpose needs, without the kernels of the purposes that it builds on.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

from multiradar.clock import SystemClock
from support.asterix.octets import datagram, pcap
from support.asterix.scene import datagrams
from support.inputs.dumps import pairs, part_of_sample, write_dump
from support.paths import ROOT
from support.processes.clients import get
from support.processes.waiting import run_to_end, wait_until

TESTS = ROOT / "tests"
LIST = ROOT / "compiled" / "multiradar_compiled" / "kernels.json"
SAMPLE = ROOT / "examples" / "vid-sample"
SENSORS = ROOT / "examples" / "sensors-vid-sample.toml"
FILTERS = ("two-stage", "imm", "joint", "blom", "blom-macro", "ci")
#: Radar plots without identity.
PRIMARY = ("--hide", "track_number,mode_3a,mode_s_address,callsign", "--kinds", "radar")
OPTIONS: dict[str, tuple[str, ...]] = {
    "--encounters": ("120",),
    "--forecasts": ("60",),
    "--trajectories": (),
    "--manoeuvre-planes": ("60",),
    "--observability": ("60",),
}
#: The shortest run of each study that calls all of its kernels.
STUDIES: dict[str, tuple[str, ...]] = {
    "bias-estimation": ("--runs", "2", "--duration", "20"),
    "polynomial-forecast": ("--runs", "100"),
    "coupled-motion": ("--runs", "2", "--duration", "20"),
    "manoeuvre-plane": ("--runs", "2"),
    "bearing-only": ("--runs", "2"),
    "trajectory-bundle": ("--runs", "2"),
}
QUERIES = (
    "tracks", "status", "sensors", "encounters", "tracks/{track}", "tracks/{track}/history",
    "tracks/{track}/forecast?horizon_s=60&step_s=10", "tracks/{track}/manoeuvre-plane",
    "tracks/{track}/observability", "tracks/{track}/plots", "residuals",
)  # fmt: skip
#: A type with a longer text is given a name in the list.
NAMED_LENGTH_MIN = 40

CLOCK = SystemClock()
_INPUTS = "KERNEL_LIST_INPUTS"

#: A kernel, the types of its arguments, and the seconds of compiling or loading it.
Call = tuple[str, tuple[str, ...], float]
Arguments = Callable[[Path, Path], list[str]]


@dataclass(frozen=True)
class Run:
    """A command whose kernels are wanted.

    Attributes
    ----------
    purpose : str
        What they are for; several runs may have the same.
    builds_on : str
        A purpose whose kernels are not repeated; empty for none.
    arguments : callable
        Given the folder of inputs and a place for outputs, the arguments of the command.
    """

    purpose: str
    builds_on: str
    arguments: Arguments


def runs() -> Iterator[Run]:
    """Yield all runs, each after what it builds on."""
    yield Run("convert vid", "", lambda _, out: ["convert", "vid", str(SAMPLE), str(out)])
    yield Run("convert vid", "", lambda i, out: ["convert", "vid", str(i / "pairs"), str(out)])
    for file in ("plots.ast", "plots.pcap"):
        yield Run("convert asterix", "", convert("asterix", file))
    for file in ("list.json", "columns.csv"):
        yield Run("convert adsb", "", convert("adsb", file))
    for name in FILTERS:
        base = f"track {name}"
        yield Run(base, "", track(name, "sample"))
        yield Run(base, "", track(name, "sample", *PRIMARY))
        yield Run(f"serve {name}", base, serve(name))
    for name in ("two-stage", "imm"):
        base = f"track {name}"
        yield Run(f"bearings {name}", base, track(name, "bearings"))
        shared = track(name, "sample", "--config", "probabilistic.toml", *PRIMARY)
        yield Run(f"track probabilistic {name}", base, shared)
        for option, values in OPTIONS.items():
            yield Run(f"track {option} {name}", base, track(name, "sample", option, *values))
    for name, options in STUDIES.items():
        yield Run(f"study {name}", "", study(name, *options))


def convert(form: str, file: str) -> Arguments:
    """Return the arguments of `convert` on one of the inputs."""
    return lambda inputs, out: ["convert", form, str(inputs / file), "--out", str(out)]


def serve(name: str) -> Arguments:
    """Return the arguments of a service that is used and stopped (`use_service`)."""
    return lambda _, out: ["serve", name, str(out)]


def study(name: str, *options: str) -> Arguments:
    """Return the arguments of a study."""
    return lambda _, out: ["study", name, *options, "--out", str(out.with_suffix(".html"))]


def track(name: str, recording: str, *options: str) -> Arguments:
    """Return the arguments of `track` on one of the inputs."""

    def arguments(inputs: Path, out: Path) -> list[str]:
        sensors = SENSORS if recording == "sample" else inputs / recording / "sensors.toml"
        given = [str(inputs / recording), "--sensors", str(sensors), "--out", str(out)]
        placed = [str(inputs / one) if one.endswith(".toml") else one for one in options]
        return ["track", *given, "--filter", name, *placed]

    return arguments


def make_inputs(recorder: "Recorder", folder: Path) -> None:
    """Make what the runs read: recordings in every form."""

    def command(*arguments: str) -> None:
        recorder.run(list(arguments), folder / "inputs.ndjson")

    command("convert", "vid", str(SAMPLE), str(folder / "sample"), "--date", "2018-08-01")
    command("simulate", "bearings-only", "--out", str(folder / "bearings"))
    write_dump(folder / "pairs", part_of_sample(500), pairs())
    (folder / "probabilistic.toml").write_text('[tracking]\nassociation = "probabilistic"\n')
    sent = list(datagrams(30_000.0, 20))
    (folder / "plots.ast").write_bytes(b"".join(one for _, one in sent))
    (folder / "plots.pcap").write_bytes(pcap((time_s, datagram(one)) for time_s, one in sent))
    reports = [
        {"timestamp": 1e9 + i, "icao24": "4b1234", "latitude": 47.0 + 0.001 * i, "longitude": 8.0,
         "altitude": 30_000.0}
        for i in range(60)
    ]  # fmt: skip
    (folder / "list.json").write_text(json.dumps(reports))
    lines = [",".join(reports[0]), *(",".join(map(str, one.values())) for one in reports)]
    (folder / "columns.csv").write_text("\n".join(lines) + "\n")


def record(arguments: list[str], file: Path) -> None:
    """Run one command in this process and write what it calls to a file, a line a call."""
    from numba.core.dispatcher import Dispatcher

    from multiradar.cli.main import run
    from multiradar_compiled.signatures import describe

    original, within = Dispatcher.compile, threading.local()

    # What is compiled within another kernel is no call; other threads may compile meanwhile.
    def noting(self: Any, signature: Any) -> Any:
        outermost, started_s = not getattr(within, "another", False), CLOCK.monotonic_s()
        within.another = True
        try:
            return original(self, signature)
        finally:
            within.another = not outermost
            module, name = self.py_func.__module__, self.py_func.__qualname__
            if outermost and module.startswith("multiradar"):
                seconds = CLOCK.monotonic_s() - started_s
                call = [f"{module}:{name}", [describe(one) for one in signature], seconds]
                with file.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(call) + "\n")

    Dispatcher.compile = noting  # type: ignore[assignment,method-assign]
    if arguments[0] == "serve":
        threading.Thread(target=use_service, args=(Path(arguments[2]),), daemon=True).start()
        arguments = [
            "serve", "--sensors", str(SENSORS), "--state", arguments[2], "--port", "0",
            "--filter", arguments[1], "--no-zenoh", "--json",
        ]  # fmt: skip
        os.dup2(os.open(Path(arguments[4]).with_suffix(".out"), os.O_CREAT | os.O_WRONLY), 1)
    status = run(arguments)
    sys.stdout.flush()
    os._exit(status)


def use_service(state: Path) -> None:
    """Replay the sample to the service of this process, ask it everything, stop it."""
    ready = state.with_suffix(".out")
    wait_until(lambda: ready.exists() and ready.read_text(), "the service")
    http = json.loads(ready.read_text())["http"]
    sample = Path(os.environ[_INPUTS]) / "sample"
    command = [sys.executable, "-m", "multiradar", "replay", str(sample), "--to", http]
    replayed = run_to_end([*command, "--speed", "max", "--encoding", "json"])
    assert replayed.returncode == 0, replayed.stderr
    # A live one: a dropped track has no plots to compute from.
    track = get(f"{http}/v1/tracks").json()["tracks"][0]["track_id"]
    for query in QUERIES:
        get(f"{http}/v1/{query.format(track=track)}")
    os.kill(os.getpid(), signal.SIGTERM)


class Recorder:
    """Runs commands, each in a process forked from one that has loaded their modules.

    Parameters
    ----------
    inputs : Path
        What the runs read.
    cache : Path, optional
        Parent folder of compiled kernels; that of this process when absent.
    """

    def __init__(self, inputs: Path, cache: Path | None = None) -> None:
        environment = {**os.environ, _INPUTS: str(inputs)}
        if cache is not None:
            environment["NUMBA_CACHE_DIR"] = str(cache)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "support.kernel_list", "--record"], cwd=TESTS, env=environment,
            text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()

    def run(self, arguments: list[str], calls: Path) -> None:
        """Run a command that writes what it calls to a file."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        started_s = CLOCK.monotonic_s()
        self._process.stdin.write(json.dumps([arguments, str(calls)]) + "\n")
        self._process.stdin.flush()
        status = self._process.stdout.readline().strip()
        print(f"{CLOCK.monotonic_s() - started_s:6.1f} s: {' '.join(arguments[:3])}", flush=True)
        if status not in ("0", str(128 + signal.SIGTERM)):
            sys.exit(f"{' '.join(arguments)}: status {status}")


def record_all() -> None:
    """Fork a process for each command on standard input, and print its status."""
    from multiradar_compiled import kernel_list

    # What is compiled beforehand would not be seen to be called.
    kernel_list.kernels_for = lambda purposes: []
    import_module("support.processes.command_modules")
    for line in sys.stdin:
        arguments, calls = json.loads(line)
        process = os.fork()
        if process == 0:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            record(arguments, Path(calls))
        print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)


def calls_of(run: Run, recorder: Recorder, inputs: Path, folder: Path) -> list[Call]:
    """Run a command and return what it calls; outputs go to a folder."""
    calls = folder / "calls.ndjson"
    calls.unlink(missing_ok=True)
    out = Path(tempfile.mkdtemp(dir=folder)) / "out"
    recorder.run(run.arguments(inputs, out), calls)
    lines = calls.read_text(encoding="utf-8").splitlines() if calls.exists() else []
    found = [json.loads(line) for line in lines]
    return [(kernel, tuple(types), seconds) for kernel, types, seconds in found]


def collect(recorder: Recorder, folder: Path) -> Iterator[dict[str, list[Call]]]:
    """Run everything and yield, after each run, the calls of each purpose so far."""
    found: dict[str, list[Call]] = {}
    for run in runs():
        known = {one[:2] for one in found.get(run.builds_on, [])}
        calls = calls_of(run, recorder, folder, folder)
        found.setdefault(run.purpose, []).extend(one for one in calls if one[:2] not in known)
        yield found


def listed(found: dict[str, list[Call]]) -> dict[str, Any]:
    """Return the list as a JSON document: long types by name, kernels in the order of names."""
    purposes: dict[tuple[str, tuple[str, ...]], set[str]] = {}
    seconds: dict[tuple[str, tuple[str, ...]], float] = {}
    for purpose, calls in found.items():
        for kernel, types, taken in calls:
            one = kernel, types
            purposes.setdefault(one, set()).add(purpose)
            seconds[one] = max(seconds.get(one, 0.0), round(taken, 1))
    long = sorted({name for _, types in purposes for name in types if len(name) > NAMED_LENGTH_MIN})
    names: dict[str, str] = {}
    for text in long:
        stem = text.partition("{")[0].rpartition(":")[2]
        names[text] = next(
            name for i in count() if (name := f"{stem}{i or ''}") not in names.values()
        )
    return {
        "purposes": sorted(found),
        "types": {name: text for text, name in names.items()},
        "kernels": [
            {
                "kernel": kernel,
                "arguments": [names.get(one, one) for one in types],
                "seconds": seconds[kernel, types],
                "purposes": sorted(purposes[kernel, types]),
            }
            for kernel, types in sorted(purposes)
        ],
    }


def differences(new: dict[str, Any]) -> list[str]:
    """Return in words what another list has more or less than the one that comes along."""
    old = json.loads(LIST.read_text(encoding="utf-8"))

    def flat(document: dict[str, Any]) -> set[tuple[str, ...]]:
        return {
            (purpose, one["kernel"], *(document["types"].get(x, x) for x in one["arguments"]))
            for one in document["kernels"]
            for purpose in one["purposes"]
        }

    more, less = flat(new) - flat(old), flat(old) - flat(new)
    return [f"missing: {' '.join(one)}" for one in sorted(more)] + [
        f"not needed: {' '.join(one)}" for one in sorted(less)
    ]


def main() -> None:
    """Write the list, or compare it."""
    parser = argparse.ArgumentParser(description="List the kernels that commands call.")
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    parser.add_argument("--record", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.record:
        record_all()
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Recorder(folder, None if options.check else folder / "cache") as recorder:
            make_inputs(recorder, folder)
            for found in collect(recorder, folder):
                document = listed(found)
                if not options.check:
                    LIST.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    if options.check:
        wrong = differences(document)
        print("\n".join(wrong) or "the list is complete")
        sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
