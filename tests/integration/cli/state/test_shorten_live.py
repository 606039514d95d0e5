"""`archive` and `shorten` beside a running service, which goes on with the same output."""

import json
import signal
from pathlib import Path

import polars as pl

from support.scenarios.recorded_scene import command, serving, write_scene

PARTS, ROWS = 5, 300


def _run(*arguments: object) -> str:
    done = command(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_shortened_service_goes_on_with_the_same_output(tmp_path: Path) -> None:
    measurements, sensors = write_scene(tmp_path, PARTS * ROWS)
    frame = pl.read_parquet(measurements)
    state, archive, config = (tmp_path / name for name in ("state", "archive", "service.toml"))
    config.write_text(
        f'sensors = "{sensors}"\n[zenoh]\nenabled = false\n[server]\nport = 0\n'
        f'[log]\nlevel = "warning"\n[retention]\njournal_octets = 1\narchive = "{archive}"\n'
    )
    given = ["--config", config]

    def feed(part: int, http: str) -> None:
        path = tmp_path / f"part-{part}.parquet"
        frame[part * ROWS : (part + 1) * ROWS].write_parquet(path)
        _run("replay", path, "--to", http, "--speed", "max", "--batch", 50, "--no-flush")

    # Each clean stop writes a snapshot; each run of `archive` seals a segment.
    for part in range(PARTS - 1):
        with serving("--state", state, *given) as served:
            feed(part, served.http)
            served.process.signal(signal.SIGTERM)
            assert served.process.wait() == 0
        _run("archive", state, archive)
        said = command("shorten", state, *given)
        if part == 0:
            assert said.returncode == 1
            assert "expected 2 snapshots that this version can use" in said.stderr
    # The older snapshot is that of the third stop: its segment is the last that was removed.
    found = json.loads(_run("shorten", state, *given, "--json"))
    assert (found["removed"], found["first"]) == (0, 3 * ROWS // 50 + 1)
    assert f"2 snapshots, first entry {found['first']}; digest " in _run("verify", state)
    with serving("--state", state, *given) as served:
        feed(PARTS - 1, served.http)
        again = command("replay", tmp_path / "part-0.parquet", "--to", served.http, "--speed",
                        "max", "--batch", 50, "--no-flush", "--json")  # fmt: skip
        assert json.loads(again.stdout)["duplicate"] == ROWS
        expected = served.status()
        assert expected["retained"]["first_entry"] == found["first"]
        _run("archive", state, archive)
        checked = {one["check"]: one for one in json.loads(
            _run("doctor", "--state", state, *given, "--json"))["checks"]}  # fmt: skip
        assert [checked[name]["level"] for name in ("journal", "archive", "ports")] == ["ok"] * 3
    whole = tmp_path / "whole"
    _run("restore", archive, whole)
    with serving("--state", whole, *given) as served:
        status = served.status()
    for name in ("output_sha256", "accepted", "journal_sequence", "output_sequence"):
        assert status[name] == expected[name]


def test_what_forbids_shortening_is_one_sentence(tmp_path: Path) -> None:
    _, sensors = write_scene(tmp_path, 10)
    state, config = tmp_path / "state", tmp_path / "service.toml"
    with serving("--sensors", sensors, "--state", state, "--port", 0, "--no-zenoh"):
        pass
    for settings, reason in (
        ("", "no rule for the journal; set journal_days or journal_octets"),
        ("[retention]\njournal_days = 1\n", "retention.archive: not set; specify the output"),
        (
            '[retention]\njournal_days = 1\narchive = "none"\n[journal]\nsnapshot_interval_s = 0\n',
            "so each start needs the whole journal: journal.snapshot_interval_s is 0",
        ),
        (
            '[retention]\njournal_days = 1\narchive = "none"\n[trajectories]\naircraft_max = 3\n',
            "trajectories requires the complete output",
        ),
        ("[retention]\narchive_days = 3\n", "archive_days: expected at least recording_days"),
        ('[retention]\njournal_days = 1\narchive = "none"\n', "expected 2 snapshots"),
        (
            '[retention]\njournal_days = 1\narchive = "none"\n[tracking]\nepoch_s = 2.0\n',
            "the journal was created with epoch_s 4.0, now 2.0; run this command",
        ),
    ):
        config.write_text(f'sensors = "{sensors}"\n{settings}')
        done = command("shorten", state, "--config", config)
        assert (done.returncode, reason in done.stderr) == (1, True), done.stderr
        assert len(done.stderr.strip().splitlines()) == 1, done.stderr
