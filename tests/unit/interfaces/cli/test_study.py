"""`multiradar study`: tables, a report that overwrites nothing, one JSON object, messages."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from multiradar.cli.main import run
from multiradar.cli.study import study_command, study_help
from multiradar.research.studies.catalogue import STUDIES, StudyEntry
from support.fakes.fake_study import ENTRY, FAILING_SEED, FIXED, HOSTILE, STOPPED_SEED
from support.processes.waiting import WAIT_TIMEOUT_S, run_to_end

CATALOGUE: dict[str, StudyEntry] = {"fake": ENTRY, "fixed": FIXED}


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _study(*arguments: object) -> int:
    commands = typer.Typer()
    commands.callback()(lambda: None)
    commands.command(name="study", help=study_help(CATALOGUE))(study_command(CATALOGUE))
    return run(["study", *map(str, arguments)], commands)


def test_tables_are_shown_and_the_report_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study("fake") == 0
    output = capsys.readouterr()
    assert not output.err
    for text in ("Main table", "two-stage", "0.251", "Second table", HOSTILE, "A second note."):
        assert text in output.out
    assert output.out.endswith("report written to fake.html\n")
    assert (tmp_path / "fake.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert [path.name for path in tmp_path.iterdir()] == ["fake.html"]


@pytest.mark.slow
def test_a_second_run_does_not_overwrite_the_first_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fake.html").write_text("precious")
    assert _study("fake") == 0
    assert capsys.readouterr().out.endswith("report written to fake-2.html\n")
    assert _study("fake") == 0
    assert (tmp_path / "fake.html").read_text() == "precious"
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"fake.html", "fake-2.html", "fake-3.html"}
    assert (tmp_path / "fake-2.html").read_bytes() == (tmp_path / "fake-3.html").read_bytes()


def test_json_is_one_object_on_standard_output_and_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study("fake", "--json", "--seed", 5, "--filters", "ci, joint,ci") == 0
    output = capsys.readouterr()
    assert not output.err
    assert json.loads(output.out) == {
        "study": "fake",
        "seed": 5,
        "options": {"runs": 3, "duration_s": 10.0, "filters": ["ci", "joint"]},
        "rows": [
            {"filter": "ci", "error_m": 0.0, "missing": None, "drift": False},
            {"filter": "joint", "error_m": 1.0, "missing": None, "drift": False},
        ],
        "notes": [HOSTILE, "A second note."],
    }
    assert not list(tmp_path.iterdir())


def test_json_with_out_writes_the_report_as_well(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study("fake", "--json", "--out", "r.html") == 0
    json.loads(capsys.readouterr().out)
    assert (tmp_path / "r.html").stat().st_size > 10_000


@pytest.mark.slow
def test_figures_are_written_beside_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study("fake", "--figures", "figures") == 0
    assert "figures written to figures, each as SVG and PDF\n" in capsys.readouterr().out
    made = sorted(path.suffix for path in (tmp_path / "figures").iterdir())
    assert made == [".pdf"] * (len(made) // 2) + [".svg"] * (len(made) // 2)
    assert made
    assert _study("fake", "--json", "--figures", "figures") == 1
    assert capsys.readouterr().err.startswith("multiradar: figures: already exists; choose another")


def test_standard_output_stays_pure_while_a_bar_is_drawn(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert _study("fake", "--json") == 0
    assert json.loads(capsys.readouterr().out)["study"] == "fake"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((), "missing argument NAME"),
        (("nonsense",), "unknown study 'nonsense'; known: fake, fixed"),
        (("fake", "--runs", "0"), "--runs: expected a whole number from 1 to 1000000, was '0'"),
        (("fake", "--runs", "2.5"), "--runs: expected a whole number from 1 to 1000000, was '2.5'"),
        (
            ("fake", "--seed", "-1"),
            f"--seed: expected a whole number from 0 to {2**63 - 1}, was '-1'",
        ),
        *(
            (
                ("fake", "--duration", duration),
                f"--duration: expected a number of seconds above 0 and at most 86400, was "
                f"'{duration}'",
            )
            for duration in ("0", "-5", "nan", "inf", "1e9", "long")
        ),
        (("fake", "--filters", "x"), "unknown filter 'x'; known: joint, two-stage, ci"),
        (
            ("fake", "--filters", "tow-stage"),
            "unknown filter 'tow-stage' (did you mean 'two-stage'?); known: joint, two-stage, ci",
        ),
    ],
)
def test_a_usage_error_is_one_sentence_status_2_and_no_file(
    arguments: tuple[str, ...], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study(*arguments) == 2
    output = capsys.readouterr()
    assert output.err == f"multiradar: {sentence}\n"
    assert not output.out
    assert not list(tmp_path.iterdir())


def test_an_option_that_a_study_does_not_support_gives_a_warning(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert _study("fixed", "--runs", 5, "--filters", "x", "--json") == 0
    output = capsys.readouterr()
    assert output.err == "multiradar: fixed does not support --runs, --filters; ignored\n"
    assert json.loads(output.out)["options"] == {"runs": None, "duration_s": None, "filters": []}


def test_an_existing_file_is_reported_and_not_touched(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "r.html"
    taken.write_text("precious")
    assert _study("fake", "--out", taken) == 1
    assert capsys.readouterr().err == (
        f"multiradar: {taken}: already exists; choose another file or remove it\n"
    )
    assert taken.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [taken]


def test_an_unwritable_path_is_reported_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # The run would fail in another way: the message shows that it was not started.
    seed = ("--seed", FAILING_SEED)
    assert _study("fake", *seed, "--out", tmp_path / "none" / "r.html") == 1
    assert "no such folder; create it before writing r.html" in capsys.readouterr().err
    assert _study("fake", *seed, "--out", tmp_path / f"{'x' * 300}.html") == 1
    assert "cannot write: File name too long" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_study_that_fails_is_one_sentence_and_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study("fake", "--seed", FAILING_SEED) == 1
    output = capsys.readouterr()
    assert output.err == "multiradar: expected a luckier seed, was 13\n"
    assert not output.out
    assert not list(tmp_path.iterdir())


def test_a_study_that_is_stopped_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _study("fake", "--seed", STOPPED_SEED) == 130
    output = capsys.readouterr()
    assert not output.err
    assert not output.out
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_ctrl_c_terminates_long_compiled_work(tmp_path: Path) -> None:
    """Regression: exit waited for threads in compiled code, which cannot be stopped."""
    code = (
        "import signal, sys\n"
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from multiradar.cli.main import main\n"
        "submit = ThreadPoolExecutor.submit\n"
        "def output(*work):\n"
        "    print('started', flush=True)\n"
        "    return submit(*work)\n"
        "ThreadPoolExecutor.submit = output\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "sys.argv = ['multiradar', 'study', 'bias-estimation', '--runs', '2000']\n"
        "main()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as one:
        try:
            assert one.stdout is not None
            assert one.stdout.readline() == "started\n"
            one.send_signal(signal.SIGINT)
            _, output = one.communicate(timeout=WAIT_TIMEOUT_S)
        finally:
            one.kill()
    rest = [line for line in output.splitlines() if "compiling kernels (first use):" not in line]
    assert (one.returncode, rest) == (130, ["multiradar: stopped"])
    assert not list(tmp_path.iterdir())


def test_help_names_every_study_with_its_sentence_and_defaults(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["study", "--help"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    for name, entry in STUDIES.items():
        assert f"{name}: {entry.purpose}" in output
        if entry.runs is not None:
            assert f"--runs {entry.runs}" in output


@pytest.mark.slow
def test_help_of_studies_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from multiradar.cli.main import run\n"
        "status = run(['study', '--help'])\n"
        "found = {'numba', 'numpy', 'scipy', 'matplotlib', 'polars'} & set(sys.modules)\n"
        "sys.exit(f'imported {found}' if found or status else 0)\n"
    )
    done = run_to_end([sys.executable, "-c", code])
    assert done.returncode == 0, done.stderr
