"""`multiradar convert vid` as a process: exit status, streams, interruption, threads."""

import json
import signal
import subprocess
from pathlib import Path

import pytest

from multiradar_converters.vid.conversion import PASSES, convert
from multiradar_converters.vid.options import Options
from support.inputs import dumps
from support.processes.commands import RUN, run_command
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

COMMAND = [*RUN, "convert", "vid"]


def command(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return run_command("convert", "vid", *arguments)


def test_it_prints_its_report_and_rejects_to_do_it_twice(tmp_path: Path) -> None:
    dump = dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(200), dumps.columns())
    done = command(dump, tmp_path / "out", "--date", "2018-08-01", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == json.loads((tmp_path / "out" / "report.json").read_bytes())
    before = dumps.contents(tmp_path / "out")
    again = command(dump, tmp_path / "out")
    assert (again.returncode, again.stdout) == (1, "")
    assert again.stderr.count("\n") == 1
    assert "exists" in again.stderr
    assert dumps.contents(tmp_path / "out") == before
    wrong = command(dump, tmp_path / "other", "--date", "1.8.2018")
    assert wrong.returncode == 2
    assert "2018-08-01" in wrong.stderr


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_stopped_leaves_nothing_finished_and_the_next_one_cleans_up(
    tmp_path: Path, how: signal.Signals
) -> None:
    part = dumps.part_of_sample(4000)
    # All files are from the first minutes.
    del part["plots_ads.txt"][690:]
    large = {name: rows * 60 for name, rows in part.items()}
    dump = dumps.write_dump(tmp_path / "dump", large, dumps.columns())
    out = tmp_path / "out"
    # Beside other work it yields to this test, and does not end before the signal.
    command_line = ["nice", "-n", "19", *COMMAND, str(dump), str(out)]
    process = subprocess.Popen(command_line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(
        lambda: process.poll() is not None or list(tmp_path.glob(".out.partial-*/.work")),
        "the work to begin",
    )
    assert process.poll() is None
    process.send_signal(how)
    assert process.wait(WAIT_TIMEOUT_S) != 0
    assert not out.exists()
    small = dumps.write_dump(tmp_path / "small", part, dumps.columns())
    done = command(small, out)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dump", "out", "small"]


def test_the_bytes_do_not_depend_on_threads_or_repetition(tmp_path: Path) -> None:
    dump = dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(5000), dumps.columns())
    results = []
    for number, threads in enumerate((1, 2, 4)):
        out = tmp_path / f"out{number}"
        dumps.run(dump, out, threads=threads)
        results.append({**dumps.contents(out), "report": (out / "report.json").read_bytes()})
    assert results[0] == results[1] == results[2]


def test_progress_reaches_its_end(tmp_path: Path) -> None:
    dump = dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(3000), dumps.columns())
    reported: list[int] = []
    convert(dump, tmp_path / "out", Options(), reported.append)
    total = PASSES * sum((dump / name).stat().st_size for name in dumps.FILES)
    # Each step may lose the fraction of a byte.
    assert total - len(reported) - 400 <= sum(reported) <= total
    assert min(reported) >= 0


def test_plots_that_are_all_rejected_end_the_run_with_the_commonest_reason(tmp_path: Path) -> None:
    part = dumps.part_of_sample(30)
    rows = [[*row[:5], "400", *row[6:]] for row in part["plots.txt"]]
    dumps.write_dump(tmp_path / "bad", {**part, "plots.txt": [["x"], *rows]}, dumps.columns())
    done = command(tmp_path / "bad", tmp_path / "out")
    assert (done.returncode, done.stdout) == (1, "")
    assert "none of 31 lines were accepted; 30 were rejected as OUT_OF_RANGE" in done.stderr
    assert "azimuth: expected 0 to 360" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_the_summary_names_rejects_by_code(tmp_path: Path) -> None:
    dump = dumps.write_dump(tmp_path / "dump", dumps.part_of_sample(30), dumps.columns())
    with (dump / "tracks.txt").open("ab") as file:
        file.write(b"x\r\ny\r\n" + b"x\t" * 8 + b"x\r\n")
    done = command(dump, tmp_path / "out")
    assert "rejected 3 (WRONG_FIELD_COUNT 2, NOT_A_NUMBER 1); blank 0" in done.stdout
    report = json.loads((tmp_path / "out" / "report.json").read_bytes())
    assert report["counts"]["rejected"] == 3
