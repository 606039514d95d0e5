"""Days in processes: one is killed, its command is stopped, and then it continues."""

import json
import os
import signal
import threading
from pathlib import Path

import pytest

from multiradar.cluster.jobs import JobProcesses
from multiradar.errors import FindingsError, OutputExistsError
from multiradar.toolbox.tracking.reprocessing.reprocess import reprocess
from support.fakes.fake_jobs import FakeJobs
from support.paths import TESTS
from support.processes import hanging_day
from support.processes.commands import Command
from support.processes.waiting import wait_until
from support.scenarios.recorded_scene import environment
from validation.tracker.archive_days import date_of

DATES = [date_of(day) for day in range(4)]
Archive = tuple[Path, Path]


@pytest.fixture
def days(archive: Archive, tmp_path: Path) -> Archive:
    """Return a folder with the first three days: their processes take seconds each."""
    folder = tmp_path / "days"
    folder.mkdir()
    for date in DATES[:3]:
        (folder / date).symlink_to(archive[0] / date)
    return folder, archive[1]


def waits_for(found: Path) -> dict[str, str]:
    """Return the process and the partial output of a day that waits."""
    wait_until(found.exists, "a day in the middle of its work")
    return dict(json.loads(found.read_text()))


def has_ended(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    # Ended, but its parent has not waited for it.
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"


def hanging(day: str, found: Path) -> JobProcesses:
    more = {hanging_day.DAY: day, hanging_day.FILE: str(found), "PYTHONPATH": str(TESTS)}
    return JobProcesses("support.processes.hanging_day", more)


@pytest.mark.slow
def test_a_killed_day_is_named_and_the_others_go_on(days: Archive, tmp_path: Path) -> None:
    out, found = tmp_path / "out", tmp_path / "waiting.json"

    def kill() -> None:
        os.kill(int(waits_for(found)["process"]), signal.SIGKILL)

    killing = threading.Thread(target=kill)
    killing.start()
    with pytest.raises(FindingsError) as raised:
        reprocess(*days, out=out, jobs=2, runner=hanging(DATES[1], found))
    killing.join()
    assert raised.value.findings == (
        f"{DATES[1]}: its process was terminated by SIGKILL (out of memory?)",
    )
    assert not (out / DATES[1]).exists()
    jobs = FakeJobs()
    again = reprocess(*days, out=out, runner=jobs)
    assert jobs.started == [DATES[1]]
    assert {one["status"] for one in again.report["figures"]["days"]} == {"made", "kept"}


def test_days_end_with_an_error_of_their_command(tmp_path: Path) -> None:
    """Their partial output is removed."""
    found = tmp_path / "waiting.json"
    jobs = hanging(DATES[0], found)
    jobs.start("day", {"day": {"date": DATES[0]}, "out": str(tmp_path / "out")})
    one = waits_for(found)
    assert Path(one["partial"]).is_dir()
    jobs.close()
    assert has_ended(int(one["process"]))
    assert not Path(one["partial"]).exists()


def test_a_process_that_cannot_start_is_explained() -> None:
    jobs = JobProcesses("support.no_such_module", {})
    jobs.start("day", {})
    event = jobs.next()
    assert event.ended
    assert "no_such_module" in event.lost
    jobs.close()


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_stopped_command_ends_its_days_and_keeps_the_complete_ones(
    number: signal.Signals, status: int, days: Archive, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    process = Command(
        "reprocess", days[0], "--sensors", days[1], "--out", out, "--jobs", "1",
        env=environment(),
    )  # fmt: skip
    complete = out / DATES[0] / "reprocess.json"
    wait_until(lambda: complete.exists() and list(out.glob(".*.partial*")), "the second day")
    process.signal(number)
    assert process.wait() == status
    process.stdout.close()
    wait_until(lambda: not list(out.glob(".*.partial*")), "the partial output to be removed")
    assert complete.exists()
    assert not (out / DATES[2]).exists()
    jobs = FakeJobs()
    reprocess(*days, out=out, runner=jobs)
    assert DATES[0] not in jobs.started
    assert DATES[2] in jobs.started


def test_two_commands_do_not_write_to_one_output(days: Archive, tmp_path: Path) -> None:
    out, found = tmp_path / "out", tmp_path / "waiting.json"
    for date in DATES[1:3]:
        # The first command would go on with them.
        (days[0] / date).unlink()

    def hold() -> None:
        with pytest.raises(FindingsError):
            reprocess(*days, out=out, jobs=1, runner=hanging(DATES[0], found))

    first = threading.Thread(target=hold)
    first.start()
    process = int(waits_for(found)["process"])
    with pytest.raises(OutputExistsError, match="another `reprocess` is writing to it"):
        reprocess(*days, out=out, runner=FakeJobs())
    os.kill(process, signal.SIGKILL)
    first.join()
