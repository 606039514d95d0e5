"""`doctor`: a line for each check of an installation, and what to do about it."""

import json
import resource
import socket
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from multiradar.cli.main import run
from multiradar.clock import FixedClock
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.settings.limits import RuntimeLimits
from multiradar.settings.service import load_settings
from multiradar.storage.entries import Entry, EntryKind
from multiradar.storage.snapshots import FORMAT_VERSION
from multiradar.storage.sqlite.file_lock import FileLock
from multiradar.storage.sqlite.growth import Growth, growth_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.toolbox.operation import installation
from multiradar.toolbox.operation.findings import Level
from multiradar.toolbox.operation.installation import check_kernels, check_packages, check_ports
from multiradar.toolbox.operation.state_health import check_clock, check_disk, check_folders
from multiradar_compiled import ahead
from support.inputs.journal_entries import entry
from support.processes.commands import RUN
from support.processes.served import SENSORS, free_port
from support.processes.waiting import run_to_end

CHECKS = (
    "python", "packages", "settings", "sensors", "kernels", "open files", "ports", "folders",
    "disk", "clock", "journal", "snapshots",
)  # fmt: skip
DAY_S = 86_400.0
NOW_S = 1_800_000_000.0


def _admission(time_s: float) -> str:
    admission = Admission.for_sensors(load_sensor_table(Path("radars.toml")), 5.0, 3600.0)
    admission.set_clock(time_s)
    return admission.state()


def _growth(octets: int, span_s: float, newest_s: float = NOW_S) -> Growth:
    return Growth(octets, _admission(newest_s - span_s), _admission(newest_s))


@pytest.fixture(name="folder", autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    port = free_port()
    (tmp_path / "radars.toml").write_text(SENSORS)
    (tmp_path / "service.toml").write_text(
        f'sensors = "radars.toml"\n[server]\nport = {port}\n[zenoh]\nenabled = false\n'
    )
    return tmp_path


def _written(folder: Path, entries: range = range(10)) -> Path:
    tracking = load_settings(None).tracking_settings()
    fingerprint = configuration_fingerprint(load_sensor_table(Path("radars.toml")), tracking)
    journal = SqliteJournal(folder / "state" / "journal.sqlite", fingerprint)
    journal.append([entry(number, rejects=number % 3) for number in entries])
    journal.close()
    return folder / "state"


def _remove(state: Path) -> None:
    for path in state.iterdir():
        path.unlink()


def _doctor(capsys: pytest.CaptureFixture[str], *more: str, status: int = 0) -> dict[str, Any]:
    capsys.readouterr()
    given = ["doctor", "--state", "state", "--config", "service.toml", "--json", *more]
    assert run(given) == status
    document = json.loads(capsys.readouterr().out)
    assert document["sound"] is (status == 0)
    return {one["check"]: one for one in document["checks"]}


def test_each_check_has_a_line_and_nothing_is_changed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = _written(folder)
    before = {path.name: path.read_bytes() for path in state.iterdir()}
    assert run(["doctor", "--state", "state", "--config", "service.toml"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[9:].partition(":")[0] for line in lines] == [*CHECKS]
    assert {line.split()[0] for line in lines} <= {"ok", "warning"}
    found = dict(zip(CHECKS, lines, strict=True))
    assert found["journal"].startswith("ok       journal: state/journal.sqlite: 10 entries, 45 ")
    assert found["snapshots"].startswith(
        "warning  snapshots: no snapshot: the next start replays the "
    )
    assert found["sensors"] == "ok       sensors: radars.toml: 3 sensors"
    assert {path.name: path.read_bytes() for path in state.iterdir()} == before


def test_a_new_installation_has_neither_journal_nor_snapshots(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = _doctor(capsys)
    assert [*found] == [name for name in CHECKS if name != "snapshots"]
    assert found["journal"]["text"].endswith(
        "not created yet; the service creates it at the first start"
    )
    assert "created at the first start" in found["folders"]["text"]
    assert not (folder / "state").exists()


def test_damage_is_an_error_with_its_place_and_what_to_do(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = _written(folder)
    file = state / "journal.sqlite"
    file.write_bytes(file.read_bytes().replace(b"source 1", b"source 9"))
    one = _doctor(capsys, status=1)["journal"]
    assert one["level"] == "error"
    assert "entry 2 of the journal is damaged" in one["text"]
    assert "more: run `multiradar verify`" in one["text"]
    assert one["advice"].startswith("restore a backup; see ")
    file.write_bytes(b"no database at all")
    assert "not a journal" in _doctor(capsys, status=1)["journal"]["text"]


def test_a_damaged_snapshot_is_a_warning_of_its_own(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    snapshots = _written(folder) / "journal.sqlite-snapshots"
    snapshots.mkdir()
    begin = b"multiradar snapshot %d\n" % FORMAT_VERSION
    (snapshots / "000000000007.snapshot").write_bytes(begin)
    found = _doctor(capsys)
    assert (found["journal"]["level"], found["snapshots"]["level"]) == ("ok", "warning")
    assert "000000000007.snapshot: damaged: " in found["snapshots"]["text"]


def test_an_archive_is_verified_and_compared_with_the_journal(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = _written(folder)
    assert run(["archive", str(state), "sealed"]) == 0
    assert "entries 1 to 10" in _doctor(capsys, "--archive", "sealed")["archive"]["text"]
    (segment,) = Path("sealed").iterdir()
    whole = segment.read_bytes()
    segment.write_bytes(whole[:-1])
    damaged = _doctor(capsys, "--archive", "sealed", status=1)["archive"]
    assert f"{segment}: damaged at entry " in damaged["text"]
    segment.write_bytes(whole)
    for entries, said in [
        (range(5, 20), "but entry 10 of the journal is another one"),
        (range(3), "but the journal has only 3"),
    ]:
        _remove(state)
        _written(folder, entries)
        other = _doctor(capsys, "--archive", "sealed", status=1)["archive"]
        assert other["text"].endswith(said)
        assert "restored from a backup: `multiradar archive` names the segm" in other["advice"]
    _remove(state)
    other = _doctor(capsys, "--archive", "sealed", status=1)["archive"]
    assert other["text"].endswith("but the journal has only 0")
    assert "no such" in _doctor(capsys, "--archive", "absent", status=1)["archive"]["text"]


def test_an_archive_of_the_settings_may_be_made_after_the_first_start(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with (folder / "service.toml").open("a") as settings:
        settings.write('[retention]\narchive = "sealed"\n')
    before = _doctor(capsys)["archive"]
    state = _written(folder)
    for absent in (before, _doctor(capsys)["archive"]):
        assert (absent["level"], absent["text"]) == ("warning", "sealed: not created yet")
        assert absent["advice"].startswith("run `multiradar archive state sealed`")
    assert run(["archive", str(state), "sealed"]) == 0
    assert _doctor(capsys)["archive"]["level"] == "ok"


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        ("[journal]\nsnapshot_interval_s = 0\n", "journal.snapshot_interval_s is 0"),
        ("[trajectories]\naircraft_max = 5\n", "trajectories.aircraft_max requires the complete"),
    ],
)
def test_settings_without_snapshots_are_named_and_no_snapshot_is_expected(
    folder: Path, capsys: pytest.CaptureFixture[str], config: str, reason: str
) -> None:
    _written(folder)
    with (folder / "service.toml").open("a") as settings:
        settings.write(config)
    found = _doctor(capsys)["snapshots"]
    assert (found["level"], reason in found["text"]) == ("ok", True), found


def test_the_history_of_the_settings_is_checked(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _written(folder)
    with (folder / "service.toml").open("a") as settings:
        settings.write('[history]\nfolder = "past"\n')
    assert _doctor(capsys)["history"]["text"].startswith("past: created at the first start; ")
    (folder / "past").write_text("a file")
    assert _doctor(capsys, status=1)["history"]["level"] == "error"


@pytest.mark.parametrize(
    ("config", "check", "text"),
    [
        ('sensors = "none.toml"\n', "sensors", "none.toml: no such file"),
        ("[tracking]\nepochs = 3\n", "settings", "unknown setting 'epochs'"),
        ('[server]\nhost = "0.0.0.0"\n', "settings", "no client has a key"),
        ('[tracking]\nepoch_s = 2.0\n', "journal", "was created with sensors other than"),
    ],
)  # fmt: skip
def test_mistakes_in_the_configuration_are_errors(
    folder: Path, capsys: pytest.CaptureFixture[str], config: str, check: str, text: str
) -> None:
    _written(folder)
    given = "" if "sensors" in config else 'sensors = "radars.toml"\n'
    (folder / "service.toml").write_text(f"{given}{config}")
    found = _doctor(capsys, status=1)
    assert (found[check]["level"], text in found[check]["text"]) == ("error", True), found[check]
    assert found[check]["advice"]
    assert "run " not in found[check]["text"]


def test_a_port_is_taken_by_another_program_or_by_the_running_service(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = _written(folder)
    port = load_settings(folder / "service.toml").server.port
    with closing(socket.create_server(("127.0.0.1", port))):
        taken = _doctor(capsys, status=1)["ports"]
        assert taken["text"] == f"HTTP 127.0.0.1:{port}: Address already in use"
        lock = FileLock(state / "journal.sqlite")
        used = _doctor(capsys)["ports"]
        lock.release()
    # It may have been given other ports on its command line.
    assert used["text"].startswith("not checked because the service is running (process ")
    assert _doctor(capsys)["ports"]["text"] == f"free: HTTP 127.0.0.1:{port}"


def test_ports_of_zenoh_and_asterix_are_tried_too(folder: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams:
        datagrams.bind(("127.0.0.1", 0))
        port = datagrams.getsockname()[1]
        with closing(socket.create_server(("127.0.0.1", 0))) as server:
            listening = server.getsockname()[1]
            (folder / "more.toml").write_text(
                f'[server]\nport = 0\n[zenoh]\nlisten = ["tcp/127.0.0.1:{listening}"]\n'
                f'[[asterix.listen]]\naddress = "127.0.0.1"\nport = {port}\n'
            )
            found = check_ports(load_settings(folder / "more.toml"), None)
    assert found.level is Level.ERROR
    expected = (f"Zenoh tcp/127.0.0.1:{listening}: Addr", f"ASTERIX 127.0.0.1:{port}: Addr")
    assert [one[:len(begin)] for one, begin in zip(found.text.split("; "), expected, strict=True)
            ] == [*expected]  # fmt: skip


def test_a_disk_lasts_as_long_as_the_last_entries_say(folder: Path) -> None:
    journal = folder / "state" / "journal.sqlite"
    limits = RuntimeLimits(disk_filling_share=2.0)
    small = check_disk(journal, limits, _growth(1000, DAY_S))
    assert (small.level, "GiB per day: sufficient for" in small.text) == (Level.OK, True)
    full = check_disk(journal, limits, _growth(1 << 50, DAY_S))
    assert (full.level, "sufficient for 0." in full.text) == (Level.WARNING, True)
    assert "data rate still unknown" in check_disk(journal, limits, _growth(1 << 50, 10.0)).text
    assert "data rate still unknown" in check_disk(journal, limits, None).text
    none_left = check_disk(journal, RuntimeLimits(disk_free_bytes_min=1 << 60), None)
    assert (none_left.level, "free some space" in none_left.advice) == (Level.ERROR, True)
    filling = check_disk(journal, RuntimeLimits(disk_filling_share=1e-9), None)
    assert filling.level is Level.WARNING


@pytest.mark.slow
def test_the_rate_counts_the_octets_that_entries_take_on_disk(folder: Path) -> None:
    for size in (100, 3000, 6000, 60_000):
        path = folder / f"{size}" / "journal.sqlite"
        journal = SqliteJournal(path, "rate")
        journal.append(
            [
                Entry(EntryKind.BATCH, "s", f"key {n}", bytes(size), 1, (), _admission(NOW_S + n))
                for n in range(401)
            ]
        )
        journal.close()
        found = growth_of(path)
        assert found is not None
        assert found.octets == pytest.approx(path.stat().st_size, rel=0.25)
        assert (found.first, found.last) == (_admission(NOW_S), _admission(NOW_S + 400))


@pytest.mark.parametrize(
    ("now_s", "newest_s", "running", "level", "text"),
    [
        (NOW_S, NOW_S - 5.0, True, Level.OK, "5 s old"),
        (NOW_S, NOW_S - 3.0 * DAY_S, False, Level.OK, "3 days old"),
        (NOW_S, NOW_S - 600.0, True, Level.WARNING, "10 min old, although the service is running"),
        (NOW_S, NOW_S + 90.0, False, Level.ERROR, "90 s ahead of the clock"),
        (0.0, NOW_S, False, Level.ERROR, "before 2026"),
    ],
)
def test_the_clock_is_compared_with_the_newest_measurement(
    now_s: float, newest_s: float, running: bool, level: Level, text: str
) -> None:
    growth = _growth(1000, DAY_S, newest_s)
    found = check_clock(FixedClock(now_s), 60.0, growth, running=running)
    assert (found.level, text in found.text) == (level, True), found


def test_a_file_in_place_of_a_folder_is_an_error(folder: Path) -> None:
    (folder / "state").write_text("a file")
    found = check_folders(folder / "state" / "journal.sqlite")
    assert (found.level, "is a file, not a folder" in found.text) == (Level.ERROR, True)


def test_packages_that_are_missing_or_of_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {"numba": "0.1", "httpx": None}
    real = installation._version
    monkeypatch.setattr(installation, "_version", lambda name: versions.get(name, real(name)))
    missing = check_packages()
    assert (missing.level, missing.text) == (Level.ERROR, "missing: httpx")
    del versions["httpx"]
    other = check_packages()
    assert (other.level, "numba 0.1 (expected " in other.text) == (Level.WARNING, True)


@pytest.mark.parametrize(("name", "more"), [("two-stage", ""), ("joint", " --all")])
def test_kernels_of_rare_filters_are_compiled_by_an_option(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, more: str
) -> None:
    monkeypatch.setattr(ahead, "missing_kernels", lambda kernels: list(kernels)[:1])
    (folder / "filter.toml").write_text(f'[tracking]\nfilter_name = "{name}"\n')
    found = check_kernels(
        load_settings(folder / "filter.toml"), load_sensor_table(Path("radars.toml"))
    )
    assert found.level is Level.WARNING
    assert found.advice.startswith(f"run `multiradar warm-up{more}` as the user")


@pytest.mark.slow
def test_kernels_that_are_not_compiled_and_a_low_limit_of_files_are_warnings(folder: Path) -> None:
    def few_files() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (300, 300))

    given = ["doctor", "--sensors", "radars.toml", "--config", "service.toml"]
    environment = {"NUMBA_CACHE_DIR": str(folder / "cache"), "PATH": "/usr/bin:/bin"}
    done = run_to_end([*RUN, *given], env=environment, preexec_fn=few_files)
    assert done.returncode == 0, done.stderr
    lines = {line[9:].partition(":")[0]: line for line in done.stdout.splitlines()}
    assert lines["kernels"].startswith("warning  kernels: ")
    assert lines["kernels"].endswith("run `multiradar warm-up` as the user of the service")
    assert str(folder / "cache") in lines["kernels"]
    assert lines["open files"].startswith(
        "warning  open files: the limit is 300, but 768 are needed"
    )
