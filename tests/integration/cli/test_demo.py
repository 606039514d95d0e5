"""The first thing a user sees runs to its end, says what it found, and leaves nothing behind."""

import json
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from support.recorded_scene import command, environment

SAMPLE = Path(__file__).parents[3] / "examples" / "vid-sample"
#: Shares of the lines of each file: the first ten minutes or so.
SHARE = 0.33


@pytest.fixture
def short_dump(tmp_path: Path) -> Path:
    dump = tmp_path / "dump"
    dump.mkdir()
    for name in ("tracks.txt", "plots.txt", "plots_ads.txt"):
        lines = (SAMPLE / name).read_bytes().splitlines(keepends=True)
        (dump / name).write_bytes(b"".join(lines[: round(SHARE * len(lines))]))
    truth = json.loads((SAMPLE / "truth.json").read_text())
    (dump / "truth.json").write_text(json.dumps({key: truth[key] for key in ("radars", "date")}))
    return dump


@pytest.mark.slow
def test_the_demo_ends_with_biases_near_the_truth_and_leaves_nothing(
    short_dump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    done = command("demo", "--dump", short_dump, "--speed", "max", "--exit")
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert not list(temporary.iterdir())
    assert "[" not in done.stdout.replace("[0", "")
    row = re.search(r"26-10 +range +\+185\.0 m +(\S+) m +(\S+) m", done.stdout)
    assert row is not None, done.stdout
    # Four sigma: one draw of the noise is as good as another.
    assert abs(float(row[1]) - 185.0) <= 4.0 * float(row[2])
    assert "aircraft tracked" in done.stdout
    assert "ADS-B positions, which the tracker has not seen" in done.stdout


@pytest.mark.slow
def test_ctrl_c_stops_the_service_and_removes_everything(
    short_dump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    line = [sys.executable, "-m", "multiradar", "demo", "--dump", str(short_dump), "--speed", "max"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=environment()) as process:
        assert process.stdout is not None
        seen = ""
        for told in process.stdout:
            seen += told
            if "/v1/status" in told:
                break
        assert "still up" in seen
        process.send_signal(signal.SIGINT)
        watchdog = threading.Timer(60.0, process.kill)
        watchdog.start()
        assert process.wait() == 0
        watchdog.cancel()
    assert not list(temporary.iterdir())


def test_a_dump_without_truth_or_sensors_is_one_sentence(short_dump: Path) -> None:
    (short_dump / "truth.json").unlink()
    done = command("demo", "--dump", short_dump, "--exit")
    assert done.returncode == 1
    assert "expected a truth.json beside the dump" in done.stderr
    assert done.stderr.count("\n") == 1
