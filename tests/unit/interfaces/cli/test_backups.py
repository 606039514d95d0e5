"""`backup`, `verify` and `restore` of a state: what they print, and what they reject."""

import json
from pathlib import Path

import pytest

from multiradar.cli.main import run
from multiradar.runtime.engine.fingerprint import configuration_fingerprint, configuration_text
from multiradar.settings.service import load_settings
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.toolbox.inputs import load_sensor_table, read_sensors
from support.inputs.journal_entries import entry
from support.processes.served import SENSORS


@pytest.fixture(name="sensors")
def _sensors(tmp_path: Path) -> Path:
    path = tmp_path / "radars.toml"
    path.write_text(SENSORS)
    return path


@pytest.fixture(name="state")
def _state(tmp_path: Path, sensors: Path) -> Path:
    return _written(tmp_path / "state", sensors, None)


def _written(folder: Path, sensors: Path, config: Path | None) -> Path:
    tracking = load_settings(config).tracking_settings()
    fingerprint = configuration_fingerprint(load_sensor_table(sensors), tracking)
    text = configuration_text(read_sensors(sensors), tracking)
    journal = SqliteJournal(folder / "journal.sqlite", fingerprint, text)
    journal.append([entry(number, rejects=number % 3) for number in range(10)])
    journal.close()
    return folder


def _tamper(file: Path) -> None:
    content = file.read_bytes()
    file.write_bytes(content.replace(b"source 1", b"source 9"))


def test_a_state_is_backed_up_verified_and_restored(
    state: Path, sensors: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, restored = tmp_path / "backup", tmp_path / "restored"
    assert run(["backup", str(state), str(out), "--sensors", str(sensors)]) == 0
    counts = "10 entries, 45 measurements, 9 rejected rows"
    assert f"{out}: {counts}, " in (said := capsys.readouterr().out)
    assert "no snapshot; verified" in said
    for path in (state, state / "journal.sqlite", out):
        assert run(["verify", str(path)]) == 0
        assert f"{path}: intact: {counts}, 0 snapshots; digest " in capsys.readouterr().out
    assert run(["restore", str(out), str(restored)]) == 0
    assert f"multiradar serve --state {restored} --sensors {restored}/sensors.toml --config " in (
        capsys.readouterr().out
    )
    assert (restored / "sensors.toml").read_text() == SENSORS
    assert run(["verify", str(restored), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["entries"], found["damage"]) == (10, [])


def test_a_backup_removes_what_a_killed_one_left_under_another_name(
    state: Path, sensors: Path, tmp_path: Path
) -> None:
    left, other = (tmp_path / f".2026-11-2{day}.partial-9999999" for day in (3, 4))
    for folder in (left, other):
        folder.mkdir()
        (folder / ".lock").touch()
    (left / "journal.sqlite").write_bytes(b"half")
    assert run(["backup", str(state), str(tmp_path / "backup"), "--sensors", str(sensors)]) == 0
    assert not left.exists()
    assert other.exists()


def test_a_state_is_archived_verified_and_restored(
    state: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, restored = tmp_path / "archive", tmp_path / "restored"
    for expected in ("10 entries sealed in 1 segment", "0 entries sealed in 0 segments"):
        assert run(["archive", str(state), str(folder)]) == 0
        assert f"{folder}: {expected}" in capsys.readouterr().out
    assert run(["verify", str(folder)]) == 0
    counts = "10 entries, 45 measurements, 9 rejected rows"
    assert f"intact: {counts}, 1 segment from entry 1 on" in capsys.readouterr().out
    assert run(["restore", str(folder), str(restored)]) == 0
    assert f"{restored}: {counts}; verified. Start the service with" in capsys.readouterr().out
    digests = []
    for path in (state, folder, restored):
        assert run(["verify", str(path), "--json"]) == 0
        digests.append(json.loads(capsys.readouterr().out)["digest"])
    assert len(set(digests)) == 1
    (segment,) = folder.iterdir()
    segment.write_bytes(segment.read_bytes()[:-1])
    for arguments in (["verify", str(folder)], ["restore", str(folder), str(tmp_path / "new")]):
        assert run(arguments) == 1
        assert f"{segment}: damaged at entry " in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_the_settings_of_the_journal_are_in_the_backup(
    sensors: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "service.toml"
    config.write_text(
        '[tracking]\nepoch_s = 2.0\nhidden_fields = ["mode_3a"]\n[server]\nport = 0\n'
    )
    state = _written(tmp_path / "state", sensors, config)
    out = tmp_path / "backup"
    given = ["backup", str(state), str(out), "--sensors", str(sensors)]
    assert run(given) == 1
    assert (
        'the journal was created with epoch_s 2.0, now 4.0; hidden_fields ["mode_3a"], now []; run '
        "this command"
    ) in capsys.readouterr().err
    assert not out.exists()
    assert run([*given, "--config", str(config), "--filter", "ci"]) == 1
    assert (
        "created with --filter imm, now ci; run this command with the options"
        in capsys.readouterr().err
    )
    assert run([*given, "--config", str(config)]) == 0
    settings = load_settings(out / "settings.toml")
    assert settings.tracking_settings() == load_settings(config).tracking_settings()
    assert settings.server.port == load_settings().server.port


def test_the_region_is_in_the_backup_without_addresses(sensors: Path, tmp_path: Path) -> None:
    """Without it, a restored service ignored the messages of the neighbours in the journal."""
    config = tmp_path / "service.toml"
    config.write_text(
        '[region]\nname = "west"\nlatitude_deg = 49.0\nlongitude_deg = 8.0\nmargin_m = 4e4\n'
        'listen = ["tcp/127.0.0.1:7461"]\n'
        '[[region.neighbours]]\nname = "east"\nlatitude_deg = 49.0\nlongitude_deg = 14.0\n'
        'endpoint = "tcp/127.0.0.1:7462"\n'
        '[[region.neighbours]]\nname = "north"\nlatitude_deg = 55.0\nlongitude_deg = 8.0\n'
    )
    state, out = _written(tmp_path / "state", sensors, config), tmp_path / "backup"
    given = ["--sensors", str(sensors), "--config", str(config)]
    assert run(["backup", str(state), str(out), *given]) == 0
    expected, found = (load_settings(one).region for one in (config, out / "settings.toml"))
    assert (found.listen, [one.endpoint for one in found.neighbours]) == ((), [None, None])
    assert found == expected.model_copy(
        update={
            "listen": (),
            "neighbours": tuple(
                one.model_copy(update={"endpoint": None}) for one in expected.neighbours
            ),
        }
    )


def test_damage_is_named_with_status_1_and_nothing_is_written(
    state: Path, sensors: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, broken = tmp_path / "backup", tmp_path / "broken"
    assert run(["backup", str(state), str(out), "--sensors", str(sensors)]) == 0
    _tamper(out / "journal.sqlite")
    _tamper(state / "journal.sqlite")
    capsys.readouterr()
    for arguments in (
        ["verify", str(state)],
        ["verify", str(out)],
        ["backup", str(state), str(broken), "--sensors", str(sensors)],
        ["restore", str(out), str(broken)],
    ):
        assert run(arguments) == 1
        shown = capsys.readouterr()
        assert "entry 2 of the journal is damaged: the digest does not match" in shown.err
        assert "Traceback" not in shown.err
        assert not shown.out
        assert not broken.exists()
    assert run(["verify", str(state), "--json"]) == 1
    assert "entry 2 of" in json.loads(capsys.readouterr().out)["damage"][0]


@pytest.mark.parametrize(
    "case",
    [
        (["backup", "state"], 2, "missing argument"),
        (["backup", "absent", "out"], 1, "absent/journal.sqlite: no such file or folder"),
        (["backup", "state", "state"], 1, "state: already exists; choose another output directory"),
        (["backup", "state", "no/out"], 1, "no such folder; create it before writing out"),
        (["backup", "state", "out", "--sensors", "absent.toml"], 1, "absent.toml: no such file"),
        (["verify", "absent"], 1, "no such file or folder"),
        (["verify", "empty"], 1, "empty: expected the state of `serve`, was an empty folder"),
        (["verify", "radars.toml"], 1, "radars.toml: not a journal; choose another file"),
        (
            ["restore", "state", "new"],
            1,
            "expected the output of `backup`, was the state of `serve`",
        ),
        (["restore", "absent", "new"], 1, "absent: no such file or folder"),
        (["restore", "absent", "state"], 1, "state: already exists; choose another output dir"),
    ],
)
def test_mistakes_are_one_sentence(
    state: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    case: tuple[list[str], int, str],
) -> None:  # fmt: skip
    arguments, status, reason = case
    folder = state.parent
    monkeypatch.chdir(folder)
    (folder / "empty").mkdir()
    before = (state / "journal.sqlite").read_bytes()
    if arguments[0] == "backup" and "--sensors" not in arguments:
        arguments = [*arguments, "--sensors", "radars.toml"]
    assert run(arguments) == status
    said = capsys.readouterr().err
    assert reason.lower() in said.lower()
    assert len(said.strip().splitlines()) == 1
    assert (state / "journal.sqlite").read_bytes() == before
    assert not (folder / "out").exists()
    assert not (folder / "new").exists()
