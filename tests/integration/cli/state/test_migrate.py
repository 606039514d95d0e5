"""A journal is continued with other sensors or settings; its measurements are tracked again."""

import json
import signal
from pathlib import Path
from typing import Any

import pytest

from support.processes.served import SENSORS
from support.scenarios.recorded_scene import command, serving, write_scene

ROWS = 1500
COMMON = ("--port", 0, "--log-level", "warning", "--no-zenoh")


@pytest.fixture(name="folder", scope="module")
def _folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("migrate")
    measurements, sensors = write_scene(folder, ROWS)
    with serving("--sensors", sensors, "--state", folder / "state", *COMMON) as served:
        assert _replay(measurements, served.http).returncode == 0
        served.status()
        served.process.signal(signal.SIGTERM)
        assert served.process.wait() == 0
    return folder


def _replay(measurements: Path, http: str) -> Any:
    return command(
        "replay", measurements, "--to", http, "--speed", "max", "--batch", 100,
        "--run-name", "one", "--no-flush",
    )  # fmt: skip


def _migrated(*arguments: object) -> dict[str, Any]:
    done = command("migrate", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_a_state_continues_with_another_filter(folder: Path, tmp_path: Path) -> None:
    sensors, measurements = folder / "sensors.toml", folder / "measurements.parquet"
    own = ("--sensors", sensors, "--filter", "two-stage")
    with serving("--state", tmp_path / "direct", *own, *COMMON) as served:
        assert _replay(measurements, served.http).returncode == 0
        expected = served.status()
    new = tmp_path / "new"
    found = _migrated(folder / "state", new, *own)
    assert (found["accepted_before"], found["accepted"], found["rejected_now"]) == (ROWS, ROWS, {})
    assert found["figures"]["output_sha256"] == expected["output_sha256"]
    assert command("verify", new).stdout.count("1 snapshot") == 1
    with serving("--state", new, *own, *COMMON) as served:
        # Senders that repeat their messages are recognised.
        assert _replay(measurements, served.http).returncode == 0
        status = served.status()
    for name in ("output_sha256", "accepted", "journal_sequence", "tracks"):
        assert status[name] == expected[name]


def test_what_is_rejected_by_the_new_sensors_is_reported(folder: Path, tmp_path: Path) -> None:
    first, *others = SENSORS.split("[[sensor]]")[1:]
    sensors, new = tmp_path / "sensors.toml", tmp_path / "new"
    sensors.write_text("".join(f"[[sensor]]{one}" for one in others))
    found = _migrated(folder / "state", new, "--sensors", sensors)
    missing = found["rejected_now"]["UNKNOWN_SENSOR"]
    assert 0 < missing == ROWS - found["accepted"]
    # And back, from the archive: rejected rows stay rejected.
    archive = tmp_path / "archive"
    assert command("archive", new, archive).returncode == 0
    back = _migrated(archive, tmp_path / "back", "--sensors", folder / "sensors.toml")
    assert (back["accepted"], back["rejected_now"]) == (ROWS - missing, {})
    done = command("migrate", folder / "state", new, "--sensors", sensors)
    assert (done.returncode, first in done.stderr) == (1, False)
    assert f"{new}: already exists" in done.stderr
