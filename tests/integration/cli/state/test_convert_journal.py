"""The measurements of a journal or archive give the output of the service again."""

import json
import signal
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest

import multiradar as mr
from multiradar.errors import ArgumentError, DataWarning, InputError, JournalError
from multiradar.storage.archive import archive_journal
from multiradar.storage.entries import MEASUREMENTS_BYTES_MAX, RejectedRow, bounded
from multiradar.storage.segments import segments_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry as journal_entry
from support.processes import clients
from support.processes.served import SENSORS
from support.scenarios.recorded_scene import command, serving, write_scene

ROWS = 1500
COMMON = ("--port", 0, "--log-level", "warning", "--no-zenoh")


def _served(folder: Path, measurements: Path, sensors: Path) -> dict[str, Any]:
    with serving("--sensors", sensors, "--state", folder, *COMMON) as served:
        done = command(
            "replay", measurements, "--to", served.http, "--speed", "max", "--batch", 100
        )
        assert done.returncode in (0, 1), done.stderr
        status = served.status()
        served.process.signal(signal.SIGTERM)
        assert served.process.wait() == 0
    return status


def _convert(*arguments: object) -> dict[str, Any]:
    done = command("convert", "journal", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def _track(folder: Path, sensors: Path, out: Path) -> dict[str, Any]:
    done = command("track", folder, "--sensors", sensors, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


@dataclass(frozen=True)
class _Scene:
    measurements: Path
    sensors: Path
    state: Path
    status: dict[str, Any]


@pytest.fixture(name="scene", scope="module")
def _scene(tmp_path_factory: pytest.TempPathFactory) -> _Scene:
    folder = tmp_path_factory.mktemp("journal")
    measurements, sensors = write_scene(folder, ROWS)
    state = folder / "state"
    return _Scene(measurements, sensors, state, _served(state, measurements, sensors))


def test_a_journal_and_its_archive_are_tracked_to_the_same_bytes(
    scene: _Scene, tmp_path: Path
) -> None:
    archive, status, sensors = tmp_path / "archive", scene.status, scene.sensors
    assert command("archive", scene.state, archive).returncode == 0
    for source in (scene.state, archive):
        out = tmp_path / f"of-{source.name}"
        report = _convert(source, "--out", out)
        assert report["counts"]["accepted"] == status["accepted"] == ROWS
        # That at the end of the replay.
        assert report["figures"]["flushes"] == 1
        tracked = _track(out, sensors, tmp_path / f"tracks-of-{source.name}")
        assert tracked["output_sha256"] == status["output_sha256"]


@pytest.mark.fault(12)
def test_measurements_of_a_sensor_that_is_described_later_are_recovered(
    scene: _Scene, tmp_path: Path
) -> None:
    measurements, sensors = scene.measurements, scene.sensors
    first, *others = SENSORS.split("[[sensor]]")[1:]
    lacking = tmp_path / "lacking.toml"
    lacking.write_text("".join(f"[[sensor]]{one}" for one in others))
    state = tmp_path / "state"
    _served(state, measurements, lacking)
    every = pl.read_parquet(measurements)
    missing = int((every["sensor_id"] == first.split('"')[1]).sum())
    assert 0 < missing < ROWS

    plain = _convert(state, "--out", tmp_path / "plain")
    assert plain["counts"] == {
        "read": ROWS, "accepted": ROWS - missing, "rejected": missing, "duplicate": 0, "blank": 0,
    }  # fmt: skip
    assert plain["rejected_by_code"] == {"UNKNOWN_SENSOR": missing}
    lines = (tmp_path / "plain" / "rejects.ndjson").read_text().splitlines()
    assert len(lines) == missing

    whole = _convert(state, "--out", tmp_path / "whole", "--recover", "UNKNOWN_SENSOR")
    assert whole["counts"]["accepted"] == ROWS
    assert whole["figures"]["recovered_by_code"] == {"UNKNOWN_SENSOR": missing}
    found = _track(tmp_path / "whole", sensors, tmp_path / "found")
    assert found["output_sha256"] == scene.status["output_sha256"]


def test_what_cannot_be_recovered_is_counted_and_named(tmp_path: Path) -> None:
    raw = (
        '{"time_s": 1700000000.5, "sensor_id": "41-10", "kind": "radar", "range_m": 50000.0, '
        '"azimuth_deg": 10.0}'
    ).ljust(4000)
    rejects = bounded(RejectedRow(number, "TIME_LATE", "late", raw) for number in range(5000))
    entry = replace(journal_entry(1), payload=b"", accepted=0, rejects=rejects)
    journal = SqliteJournal(tmp_path / "journal.sqlite", "f")
    journal.append([entry])
    journal.close()
    kept = MEASUREMENTS_BYTES_MAX // len(raw)
    with pytest.warns(DataWarning, match=rf"^{5000 - kept} rejected rows .* were not recovered"):
        run = mr.convert(tmp_path, recover=["TIME_LATE"])
    assert run.report["figures"]["recovered_by_code"] == {"TIME_LATE": kept}
    assert run.report["figures"]["not_recovered"] == 5000 - kept


def test_data_times_set_by_an_operator_are_named(scene: _Scene, tmp_path: Path) -> None:
    state = tmp_path / "state"
    row = {"time_s": 1700000000.0, "sensor_id": "41-10", "kind": "radar", "range_m": 50e3}
    with (
        serving("--sensors", scene.sensors, "--state", state, *COMMON) as served,
        clients.client(served.http) as client,
    ):
        sent = client.post("/v1/measurements", json=[row | {"azimuth_deg": 9.0}])
        assert sent.json()["accepted"] == 1
        for time_s in (1700003600.0, 1700000000.0):
            answer = client.post("/v1/clock", params={"time_s": time_s})
            assert answer.status_code == 200, answer.text
    with pytest.warns(DataWarning, match=r"set by an operator .*: entry 2, entry 3; `track` does"):
        run = mr.convert(state)
    assert run.report["figures"]["clock_changes"] == [
        {"entry": 2, "time_s": 1700003600.0}, {"entry": 3, "time_s": 1700000000.0},
    ]  # fmt: skip


def test_only_the_chosen_time_is_converted(scene: _Scene) -> None:
    state = scene.state
    time_s = pl.read_parquet(scene.measurements)["time_s"].sort()
    begin_s, end_s = float(time_s[ROWS // 3]), float(time_s[2 * ROWS // 3])
    run = mr.convert(state, from_s=begin_s, until_s=end_s)
    wanted = time_s.filter((time_s >= begin_s) & (time_s < end_s))
    assert run.measurements["time_s"].sort().equals(wanted)
    assert run.report["figures"]["outside"] == ROWS - len(wanted)
    with pytest.raises(InputError, match=r"no measurements in the selected period"):
        mr.convert(state, from_s=end_s + 1e6)
    with pytest.raises(ArgumentError, match=r"`from_s`: expected a time before"):
        mr.convert(state, from_s=2.0, until_s=1.0)
    with pytest.raises(ArgumentError, match=r"did you mean 'TIME_LATE'"):
        mr.convert(state, recover=["TIME_LATEST"])


def test_a_damaged_or_incomplete_archive_is_not_converted(scene: _Scene, tmp_path: Path) -> None:
    archive, out = tmp_path / "archive", tmp_path / "out"
    archive_journal(scene.state / "journal.sqlite", archive, segment_octets=20_000)
    first, second, *_ = segments_of(archive)
    octets = bytearray(first.path.read_bytes())
    octets[len(octets) // 2] ^= 1
    first.path.write_bytes(octets)
    with pytest.raises(JournalError, match=f"{first.path}: damaged at entry"):
        mr.convert(archive, out=out)
    octets[len(octets) // 2] ^= 1
    first.path.write_bytes(octets)
    second.path.unlink()
    with pytest.raises(JournalError, match=f"{archive}: entries .* are missing"):
        mr.convert(archive, out=out)
    # The segments after a removed beginning are an archive.
    first.path.unlink()
    assert mr.convert(archive, out=out).report["figures"]["first_entry"] == second.last + 1
