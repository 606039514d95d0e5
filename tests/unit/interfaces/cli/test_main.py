"""The command line: help everywhere, one sentence for each error, status 0, 1 or 2."""

import sys
from pathlib import Path

import pytest
import typer

from multiradar.cli.main import app, run
from multiradar.errors import InputError, UnknownFilterError
from multiradar.settings.variables import TRACEBACK_VARIABLE
from support.processes.waiting import run_to_end

COMMANDS = (
    "track", "serve", "replay", "demo", "simulate", "study", "evaluate", "convert", "convert vid",
)  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*command.split(), "--help"]) == 0
    output = capsys.readouterr()
    assert "Usage: multiradar" in output.out
    assert not output.err


def test_the_overview_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    output = capsys.readouterr().out
    for command in (one for one in COMMANDS if " " not in one):
        assert f" {command} " in output


@pytest.mark.parametrize(
    "command", ["backup", "archive", "shorten", "verify", "restore", "migrate", "doctor"]
)
def test_help_shows_the_whole_sentence_of_a_command(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    (callback,) = (one.callback for one in app.registered_commands if one.name == command)
    assert callback is not None
    assert callback.__doc__ is not None
    assert run([command, "--help"]) == 0
    # What looks like markup, such as the name of a section in brackets, would be missing.
    assert callback.__doc__.splitlines()[0] in capsys.readouterr().out


def test_the_version_is_that_of_the_distribution(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("multiradar 0.")


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["track"],
        ["track", "m.parquet", "--sensors", "s.toml"],
        ["track", "m.parquet", "--sensors", "s.toml", "--out", "o", "--filter", "kalman"],
        ["track", "m.parquet", "--sensors", "s.toml", "--out", "o", "--kinds", "radar,sonar"],
        ["track", "m.parquet", "--sensors", "s.toml", "--out", "o", "--batch", "0"],
        ["track", "m.parquet", "--sensors", "s.toml", "--out", "o", "--date", "1.8.2018"],
        ["serve", "--port", "70000"],
        ["serve", "--log-level", "verbose"],
        ["replay", "m.parquet", "--speed", "0"],
        ["replay", "m.parquet", "--speed", "fast"],
        ["replay", "m.parquet", "--speed", "nan"],
        ["replay", "m.parquet", "--encoding", "xml"],
        ["replay", "m.parquet", "--batch", "100000"],
        ["replay", "m.parquet", "--run-name", "été"],
        ["evaluate", "tracks"],
        ["evaluate", "tracks", "--truth", "a", "--adsb", "b"],
        ["evaluate", "tracks", "--truth", "a", "--preset", "ed143"],
        ["evaluate", "tracks", "--truth", "a", "--gate", "0"],
        ["evaluate", "tracks", "--truth", "a", "--order", "0.5"],
        ["evaluate", "tracks", "--truth", "a", "--step", "nan"],
        ["convert", "vid"],
        ["demo", "--speed", "-1"],
        ["convert", "nonsense"],
        ["convert", "asterix", "n\udcff.gps", "--out", "o"],
        *(
            ["track", "m.parquet", "--sensors", "s.toml", "--out", "o", "--workers", workers]
            for workers in ("0", "x")
        ),
    ],
)
def test_a_usage_error_is_one_sentence_and_status_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(arguments) == 2
    output = capsys.readouterr()
    assert not output.out
    assert output.err.startswith("multiradar: ")
    assert output.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ["nonsense"],
            "unknown command 'nonsense'; known: inspect, align, track, reprocess, export, "
            "view, serve, replay, backup, archive, shorten, verify, restore, migrate, doctor, "
            "demo, simulate, evaluate, key, warm-up, study, convert",
        ),
        (
            ["trakc"],
            "unknown command 'trakc' (did you mean 'track'?); known: inspect, align, track, "
            "reprocess, export, view, serve, replay, backup, archive, shorten, verify, restore, "
            "migrate, doctor, demo, simulate, evaluate, key, warm-up, study, convert",
        ),
        (
            ["convert", "vidd"],
            "unknown command 'vidd' (did you mean 'vid'?); known: vid, asterix, adsb, journal",
        ),
        (
            ["serve", "--filter", "foo"],
            "--filter: unknown filter 'foo'; known: two-stage, imm, joint, blom, blom-macro, ci",
        ),
        (
            ["replay", "m", "--batch", "0"],
            "--batch: expected a whole number from 1 to 65536, was '0'",
        ),
        (["track", "m"], "missing option --sensors FILE"),
        (["track"], "missing argument MEASUREMENTS"),
        (["track", "m", "--sensors"], "missing value for option --sensors FILE"),
        (["track", "m", "-q"], "unknown option '-q'; see --help"),
        (
            ["track", "m", "-s", "s.toml"],
            "unknown option '-s' (did you mean '--sensors'?); see --help",
        ),
        (
            ["track", "m", "--sesnors", "s.toml"],
            "unknown option '--sesnors' (did you mean '--sensors'?); see --help",
        ),
        (
            ["convert", "vid", "dump", "--out", "made"],
            "unknown option '--out': OUT is a positional argument; omit --out; see --help",
        ),
        (
            ["track", "m", "--kinds", "radar,asdb"],
            "--kinds: unknown kind 'asdb' (did you mean 'adsb'?); known: radar, adsb, mlat, "
            "bearing",
        ),
        (
            ["convert", "vid", "a", "b", "c d"],
            "unexpected argument 'c d'; quote names that contain spaces",
        ),
        (["serve", "--port", "x"], "--port: expected a whole number from 0 to 65535, was 'x'"),
        (["serve", "--port=-1"], "--port: expected a whole number from 0 to 65535, was '-1'"),
        (
            ["track", "m", "--sensors", "a", "--workers", "0"],
            "--workers: expected a whole number of at least 1, was '0'",
        ),
        (["track", "m", "--out", "a", "--out=b"], "--out: given 2 times, expected once"),
        (
            ["serve", "--zenoh", "--no-zenoh"],
            "--zenoh and --no-zenoh: given 2 times, expected once",
        ),
        (["track", ""], "empty argument after 'track' (an unset shell variable?)"),
    ],
)
def test_a_usage_error_names_the_option_and_what_was_expected(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    assert capsys.readouterr().err == f"multiradar: {sentence}\n"


def test_an_option_of_several_values_may_be_repeated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    presets = ["--preset", "ed142-tma", "--preset", "ed142-enroute"]
    assert run(["evaluate", "tracks", "--truth", str(tmp_path / "none"), *presets]) == 1
    assert "none: no such file or folder" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["convert"]])
def test_no_command_is_help_without_an_empty_error(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    output = capsys.readouterr()
    assert "Usage: multiradar" in output.out
    assert not output.err


def _failing(error: BaseException) -> typer.Typer:
    app = typer.Typer()

    @app.command()
    def fail() -> None:
        raise error

    return app


@pytest.mark.parametrize(
    ("error", "status", "sentence"),
    [
        (InputError("a.parquet: expected\n a file"), 1, "multiradar: a.parquet: expected a file\n"),
        (UnknownFilterError("x", ["ci"]), 2, "multiradar: unknown filter 'x'; known: ci\n"),
        (FileNotFoundError(2, "No such file", "a"), 1, "multiradar: a: No such file\n"),
        (OSError("disk"), 1, "multiradar: disk\n"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_an_error_becomes_a_sentence_and_a_status(
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    status: int,
    sentence: str,
) -> None:
    assert run([], _failing(error)) == status
    output = capsys.readouterr()
    assert output.err == sentence
    assert not output.out


def test_an_internal_error_is_one_sentence_with_a_hint(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    failing = _failing(ZeroDivisionError("division by zero"))
    assert run([], failing) == 1
    output = capsys.readouterr().err
    assert output.startswith("multiradar: internal error, ZeroDivisionError: division by zero")
    assert TRACEBACK_VARIABLE in output
    monkeypatch.setenv(TRACEBACK_VARIABLE, "1")
    with pytest.raises(ZeroDivisionError):
        run([], failing)


@pytest.mark.slow
def test_a_closed_pipe_gives_no_traceback() -> None:
    command = f"{sys.executable} -m multiradar track --help | head -c 10; exit ${{PIPESTATUS[0]}}"
    done = run_to_end(["bash", "-c", command])
    assert "Traceback" not in done.stderr
    assert done.returncode in (0, 1)


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from multiradar.cli.main import run\n"
        "status = run(['--help'])\n"
        "heavy = {'numba', 'numpy', 'polars', 'zenoh', 'fastapi', 'pydantic', 'scipy', 'httpx'}\n"
        "found = heavy & set(sys.modules)\n"
        "sys.exit(f'imported {found}' if found or status else 0)\n"
    )
    done = run_to_end([sys.executable, "-c", code])
    assert done.returncode == 0, done.stderr


def test_tables_that_are_not_requested_are_not_imported() -> None:
    code = (
        "import sys\n"
        "import multiradar.runtime.offline.offline_run\n"
        "tables = {'encounter_table', 'trajectory_table', 'forecast_table'}\n"
        "heavy = {f'multiradar.runtime.offline.{name}' for name in tables} | {'scipy.special'}\n"
        "found = heavy & set(sys.modules)\n"
        "sys.exit(f'imported {found}' if found else 0)\n"
    )
    done = run_to_end([sys.executable, "-c", code])
    assert done.returncode == 0, done.stderr
