"""A backup of a running service: the restored one continues with the bytes of the first."""

import signal
from pathlib import Path

import polars as pl

from support.scenarios.recorded_scene import command, serving, write_scene

ROWS = 1500


def _replay(measurements: Path, http: str, name: str) -> None:
    done = command(
        "replay", measurements, "--to", http, "--speed", "max", "--batch", 50, "--run-name", name,
        "--no-flush",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_a_backup_of_a_running_service_continues_with_the_same_bytes(tmp_path: Path) -> None:
    measurements, sensors = write_scene(tmp_path, ROWS)
    frame = pl.read_parquet(measurements)
    parts = [tmp_path / "first.parquet", tmp_path / "second.parquet"]
    frame[: ROWS // 2].write_parquet(parts[0])
    frame[ROWS // 2 :].write_parquet(parts[1])
    common = ["--port", 0, "--log-level", "warning", "--no-zenoh"]
    first, out, restored = tmp_path / "first", tmp_path / "backup", tmp_path / "restored"
    with serving("--sensors", sensors, "--state", first, *common) as served:
        _replay(parts[0], served.http, "one")
        made = command("backup", first, out, "--sensors", sensors)
        assert made.returncode == 0, made.stderr
        assert command("verify", first).returncode == 0
        _replay(parts[1], served.http, "two")
        expected = served.status()
        served.process.signal(signal.SIGTERM)
        assert served.process.wait() == 0
    done = command("restore", out, restored)
    assert done.returncode == 0, done.stderr
    own = ["--sensors", restored / "sensors.toml", "--config", restored / "settings.toml"]
    with serving("--state", restored, *own, *common) as served:
        _replay(parts[1], served.http, "two")
        found = served.status()
    for name in ("output_sha256", "accepted", "journal_sequence", "output_sequence"):
        assert found[name] == expected[name]
    assert command("verify", first).returncode == 0
    archive, again = tmp_path / "archive", tmp_path / "again"
    for arguments in (("archive", first, archive), ("restore", archive, again)):
        done = command(*arguments)
        assert done.returncode == 0, done.stderr
    with serving("--state", again, "--sensors", sensors, *common) as served:
        assert served.status()["output_sha256"] == expected["output_sha256"]
