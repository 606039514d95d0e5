"""A journal is continued with other sensors or settings; its measurements are tracked again."""

import json
import signal
import sqlite3
from pathlib import Path
from typing import Any

import httpx
import pytest

from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite.shortening import digests_of, remove_until
from support.processes.served import SENSORS
from support.processes.waiting import WAIT_TIMEOUT_S
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


def test_the_sensors_file_overrides_changes_on_request(tmp_path: Path) -> None:
    measurements, sensors = write_scene(tmp_path, ROWS)
    state, moved = tmp_path / "state", {"latitude_deg": 50.3, "range_sigma_m": 90.0}
    with serving("--sensors", sensors, "--state", state, *COMMON) as served:
        path = f"{served.http}/v1/sensors/41-10"
        known = httpx.get(f"{path}/configuration", timeout=WAIT_TIMEOUT_S).json()
        changed = httpx.put(path, json=known | moved, timeout=WAIT_TIMEOUT_S)
        assert changed.status_code == 200, changed.text
        assert _replay(measurements, served.http).returncode == 0
        served.status()
    done = command("migrate", state, tmp_path / "same", "--sensors", sensors, "--json")
    assert "changes of 41-10 that were made with PUT are reapplied" in done.stderr
    same = json.loads(done.stdout)
    found = _migrated(state, tmp_path / "new", "--sensors", sensors, "--override-changes")
    assert same["changed_sensors"] == found["changed_sensors"] == {"41-10": 1}
    assert same["entries"] == found["entries"]
    # Like a service in which it was not moved.
    with serving("--sensors", sensors, "--state", tmp_path / "direct", *COMMON) as served:
        assert _replay(measurements, served.http).returncode == 0
        expected = served.status()["output_sha256"]
    assert found["figures"]["output_sha256"] == expected != same["figures"]["output_sha256"]


def test_changes_before_the_first_entry_of_a_shortened_journal_are_reapplied(
    tmp_path: Path,
) -> None:
    measurements, sensors = write_scene(tmp_path, ROWS)
    state, archive = tmp_path / "state", tmp_path / "archive"

    def changed(http: str, sensor_id: str, **values: object) -> None:
        path = f"{http}/v1/sensors/{sensor_id}"
        known = httpx.get(f"{path}/configuration", timeout=WAIT_TIMEOUT_S).json()
        done = httpx.put(path, json=known | values, timeout=WAIT_TIMEOUT_S)
        assert done.status_code == 200, done.text

    with serving("--sensors", sensors, "--state", state, *COMMON) as served:
        for sigma_m in (80.0, 90.0):
            changed(served.http, "41-10", range_sigma_m=sigma_m)
        changed(served.http, "adsb", enabled=False)
        assert command("archive", state, archive).returncode == 0
        assert _replay(measurements, served.http).returncode == 0
        changed(served.http, "adsb", enabled=True)
        served.status()
    assert command("archive", state, archive).returncode == 0
    journal = state / "journal.sqlite"
    remove_until(journal, Position(3, digests_of(journal, [3])[3]))
    assert command("verify", state).returncode == 0
    found = _migrated(state, tmp_path / "new", "--sensors", sensors)
    assert found["changed_sensors"] == {"41-10": 1, "adsb": 2}
    assert 0 < found["accepted"] == found["accepted_before"] < ROWS
    with serving("--sensors", sensors, "--state", tmp_path / "new", *COMMON) as served:
        path = f"{served.http}/v1/sensors/41-10/configuration"
        assert httpx.get(path, timeout=WAIT_TIMEOUT_S).json()["range_sigma_m"] == 90.0
    own = _migrated(state, tmp_path / "own", "--sensors", sensors, "--override-changes")
    assert own["changed_sensors"] == {"adsb": 1}
    with sqlite3.connect(journal) as connection:
        connection.execute("UPDATE sensor_change SET payload = replace(payload, '90', '91')")
    assert "the sensor change does not match the digest" in command("verify", state).stderr
    # The archive without its first segment does not have them.
    min(archive.iterdir()).unlink()
    done = command("migrate", archive, tmp_path / "none", "--sensors", sensors)
    assert "changes made with PUT before it are unknown; use --override-changes" in done.stderr
    assert done.returncode == 1


def test_a_change_that_does_not_apply_names_the_option(tmp_path: Path) -> None:
    measurements, sensors = write_scene(tmp_path, 200)
    state, other = tmp_path / "state", tmp_path / "other.toml"
    with serving("--sensors", sensors, "--state", state, *COMMON) as served:
        path = f"{served.http}/v1/sensors/41-10"
        known = httpx.get(f"{path}/configuration", timeout=WAIT_TIMEOUT_S).json()
        changed = httpx.put(path, json=known | {"range_sigma_m": 90.0}, timeout=WAIT_TIMEOUT_S)
        assert changed.status_code == 200, changed.text
        assert _replay(measurements, served.http).returncode == 0
        served.status()
    text = sensors.read_text()
    gain = 'kind = "radar"\nbias.range_gain.estimate = true\n'
    other.write_text(text.replace('kind = "radar"\n', gain, 1))
    done = command("migrate", state, tmp_path / "new", "--sensors", other)
    assert done.returncode == 1
    assert "a change of 41-10 in the journal does not apply to the sensors file" in done.stderr
    assert "--override-changes" in done.stderr
    found = _migrated(state, tmp_path / "new", "--sensors", other, "--override-changes")
    assert found["accepted"] == 200


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
