"""The sample on shards of Ray: one is killed, and the output is that of threads.

    python -m validation.service.demo_cluster [--shards 2]

It runs in a network namespace with the loopback interface only, which it makes itself.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

import httpx

from multiradar.clock import SystemClock
from validation.service.namespace import in_namespace, is_in_namespace, why_no_namespace

SAMPLE, SENSORS = "examples/vid-sample", "examples/sensors-vid-sample.toml"
LISTEN = "127.0.0.1"
#: Batches after which a shard is killed: a third of the recording.
KILL_AFTER_BATCHES = 500
SPEED = "150"
_ANSWER_TIMEOUT_S, _END_TIMEOUT_S, _POLL_S = 60.0, 900.0, 0.1
CLOCK = SystemClock()


def main() -> int:
    """Run the demo; the exit status is 0 if both outputs have the same digest."""
    parser = argparse.ArgumentParser(prog="python -m validation.service.demo_cluster")
    parser.add_argument("--shards", type=int, default=2)
    options = parser.parse_args()
    if not is_in_namespace():
        reason = why_no_namespace()
        if reason:
            print(f"demo-cluster: cannot make a network namespace: {reason}", file=sys.stderr)
            return 1
        line = [sys.executable, "-m", "validation.service.demo_cluster", *sys.argv[1:]]
        return subprocess.run(in_namespace(line), check=False).returncode
    with tempfile.TemporaryDirectory(prefix="multiradar-cluster-") as folder:
        return _play(Path(folder), options.shards)


def _play(folder: Path, shards: int) -> int:
    converted = folder / "converted"
    _run("convert", "vid", SAMPLE, converted, "--date", "2018-08-01")
    said = _run(
        "track", converted, "--sensors", SENSORS, "--kinds", "radar", "--workers", 1,
        "--out", folder / "tracks", "--json",
    )  # fmt: skip
    expected = json.loads(said)["output_sha256"]
    print(f"threads       output_sha256 {expected}", flush=True)
    settings = folder / "settings.toml"
    settings.write_text('[log]\nlevel = "warning"\n', encoding="utf-8")
    serve = subprocess.Popen(
        _line(
            "serve", "--sensors", SENSORS, "--state", folder / "state", "--port", 0, "--no-zenoh",
            "--engine", "ray", "--workers", shards, "--cluster-listen", LISTEN, "--json",
            "--config", settings,
        ),
        stdout=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    try:
        assert serve.stdout is not None
        address = str(json.loads(_first_document(serve.stdout))["http"])
        return _compare(address, converted, expected)
    finally:
        serve.terminate()
        serve.wait(_END_TIMEOUT_S)


def _compare(address: str, converted: Path, expected: str) -> int:
    replay = subprocess.Popen(
        _line("replay", converted, "--to", address, "--kinds", "radar", "--speed", SPEED),
        stdout=subprocess.DEVNULL,
    )
    _await(lambda: _status(address)["cluster"]["batches"] >= KILL_AFTER_BATCHES or _ended(replay))
    killed = shard_processes()[0]
    os.kill(killed, signal.SIGKILL)
    print(f"killed        shard process {killed}, kill -9, during the replay", flush=True)
    if replay.wait(_END_TIMEOUT_S):
        return 1
    _await(lambda: not _status(address)["cluster"]["partitions_of_front"] or _ended(replay))
    status = _status(address)
    cluster, found = status["cluster"], str(status["output_sha256"])
    print(f"ray, {cluster['shards']} shards output_sha256 {found}")
    rows, front = cluster["rows"], cluster["rows_of_front"]
    print(
        f"{rows:,} rows in {cluster['batches']:,} batches, {front:,} stepped by the front; "
        f"{cluster['octets_sent'] / rows:,.0f} octets sent and "
        f"{cluster['octets_received'] / rows:,.0f} received per row"
    )
    recovered = cluster["recovery_s"]
    shown = "not restored before the end" if recovered is None else f"restored in {recovered:.1f} s"
    print(f"{cluster['lost']} shard lost, {shown}; meanwhile the front stepped its aircraft")
    print("same output" if found == expected else "expected the same output, was another")
    return int(found != expected)


def shard_processes() -> list[int]:
    """Return the processes of shards in this network namespace, ascending."""
    own = os.readlink("/proc/self/ns/net")
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            named = re.match(rb"ray::.*Shard", (folder / "cmdline").read_bytes())
            if named and os.readlink(folder / "ns/net") == own:
                found.append(int(folder.name))
        except OSError:
            continue  # It has ended, or is of another user.
    return sorted(found)


def _await(condition: Any) -> None:
    end_s, waiting = CLOCK.monotonic_s() + _END_TIMEOUT_S, threading.Event()
    while not condition():
        if CLOCK.monotonic_s() > end_s:
            raise SystemExit(f"demo-cluster: waited {_END_TIMEOUT_S:.0f} s for the service")
        waiting.wait(_POLL_S)


def _ended(process: "subprocess.Popen[bytes]") -> bool:
    return process.poll() is not None


def _status(address: str) -> dict[str, Any]:
    answer = httpx.get(f"{address}/v1/status", timeout=_ANSWER_TIMEOUT_S)
    found: dict[str, Any] = answer.raise_for_status().json()
    return found


def _first_document(stream: Any) -> str:
    for line in stream:
        if re.match(r"\{", line):
            return str(line)
    raise SystemExit("demo-cluster: the service did not start")


def _line(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "multiradar", *map(str, arguments)]


def _run(*arguments: object) -> str:
    return subprocess.run(_line(*arguments), check=True, stdout=subprocess.PIPE, text=True).stdout


if __name__ == "__main__":
    sys.exit(main())
