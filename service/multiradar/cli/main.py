"""The command `multiradar`: subcommands, one line per error, exit status 0, 1 or 2."""

import functools
import gc
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Annotated, Any

import typer

from multiradar.cli.alignment.align import ALIGN_HELP, align
from multiradar.cli.backups import archive, backup, migrate, restore, shorten, verify
from multiradar.cli.conversion.adsb import ADSB_HELP, convert_adsb
from multiradar.cli.conversion.asterix import ASTERIX_HELP, convert_asterix
from multiradar.cli.conversion.convert import convert_app
from multiradar.cli.conversion.journal import JOURNAL_HELP, convert_journal
from multiradar.cli.demonstration.demo import demo
from multiradar.cli.doctor import doctor
from multiradar.cli.evaluation.evaluate import evaluate
from multiradar.cli.inspection.inspect import INSPECT_HELP, inspect
from multiradar.cli.key import key
from multiradar.cli.outputs.export import EXPORT_HELP, export
from multiradar.cli.playback.replay import replay
from multiradar.cli.playback.view import VIEW_HELP, view
from multiradar.cli.serve import serve
from multiradar.cli.simulate import simulate
from multiradar.cli.study import study_command, study_help
from multiradar.cli.terminal.stopping import EXIT_INTERRUPTED, end_on_signals, leave
from multiradar.cli.terminal.usage import check_arguments, usage_sentence
from multiradar.cli.tracking.reprocess import REPROCESS_HELP, reprocess
from multiradar.cli.tracking.track import track
from multiradar.cli.warm_up import warm_up
from multiradar.errors import (
    ArgumentError,
    DataWarning,
    FindingsError,
    MultiradarError,
    UnknownFilterError,
)
from multiradar.research.studies.catalogue import STUDIES
from multiradar.settings.variables import TRACEBACK_VARIABLE
from multiradar.toolbox.messages.sentences import error_sentence
from multiradar_schemas.documents.names import unknown

EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_USAGE = 2

app = typer.Typer(
    name="multiradar",
    help="Joint estimation of aircraft tracks and radar biases.",
    epilog="Exit status: 0 success, 1 data error, 2 usage error.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
convert_app.command(name="asterix", help=ASTERIX_HELP)(convert_asterix)
convert_app.command(name="adsb", help=ADSB_HELP)(convert_adsb)
convert_app.command(name="journal", help=JOURNAL_HELP)(convert_journal)
app.add_typer(convert_app, name="convert")
app.command(name="inspect", help=INSPECT_HELP)(inspect)
app.command(name="align", help=ALIGN_HELP)(align)
app.command(name="track")(track)
app.command(name="reprocess", help=REPROCESS_HELP)(reprocess)
app.command(name="export", help=EXPORT_HELP)(export)
app.command(name="view", help=VIEW_HELP)(view)
app.command(name="serve")(serve)
app.command(name="replay")(replay)
app.command(name="backup")(backup)
app.command(name="archive")(archive)
app.command(name="shorten")(shorten)
app.command(name="verify")(verify)
app.command(name="restore")(restore)
app.command(name="migrate")(migrate)
app.command(name="doctor")(doctor)
app.command(name="demo")(demo)
app.command(name="simulate")(simulate)
app.command(name="evaluate")(evaluate)
app.command(name="key")(key)
app.command(name="warm-up")(warm_up)
app.command(name="study", help=study_help(STUDIES))(study_command(STUDIES))


def main(commands: typer.Typer = app) -> None:
    """Run the command given by the arguments of the process and exit with its status."""
    end_on_signals()
    status = run(sys.argv[1:], commands)
    if status == EXIT_INTERRUPTED:
        leave(status)
    # Python would look for garbage in all that was loaded, for half a second, and then end anyway.
    gc.freeze()
    sys.exit(status)


def run(arguments: Sequence[str], commands: typer.Typer = app) -> int:
    """Run one command and return its exit status.

    Parameters
    ----------
    arguments : sequence of str
        Arguments after the name of the program.
    commands : typer.Typer
        The available commands.

    Returns
    -------
    int
        0 done, 1 data error, 2 usage error, 130 stopped by Ctrl-C.
    """
    root = _built(commands)
    with warnings.catch_warnings():
        warnings.simplefilter("always", DataWarning)
        warnings.showwarning = _show_warning  # type: ignore[assignment]  # more is not used
        return _run(arguments, root)


# Tests run hundreds of commands in a process.
@functools.cache
def _built(commands: typer.Typer) -> Any:
    return typer.main.get_command(commands)


def _run(arguments: Sequence[str], root: Any) -> int:
    try:
        return _invoke(arguments, root)
    except BrokenPipeError:
        return _leave_broken_pipe()
    except (KeyboardInterrupt, typer.Abort):
        return EXIT_INTERRUPTED
    except (typer.TyperException, UnknownFilterError, ArgumentError) as error:
        return _print_error(_usage(error, arguments, root), EXIT_USAGE)
    except (MultiradarError, OSError) as error:
        return _fail(error)
    except Exception as error:
        if os.environ.get(TRACEBACK_VARIABLE) == "1":
            raise
        return _fail(error)


def _invoke(arguments: Sequence[str], root: Any) -> int:
    check_arguments(arguments, root)
    status = root.main(args=list(arguments), prog_name="multiradar", standalone_mode=False)
    sys.stdout.flush()
    return status if isinstance(status, int) else EXIT_DONE


def _usage(error: Exception, arguments: Sequence[str], root: Any) -> str:
    if isinstance(error, UnknownFilterError):
        return unknown("filter", error.name, error.known)
    if isinstance(error, ArgumentError):
        return error.sentence_of(lambda name: f"--{name.replace('_', '-')}")
    return usage_sentence(error, arguments, root)


def _fail(error: Exception) -> int:
    for sentence in error.findings if isinstance(error, FindingsError) else [error_sentence(error)]:
        _print_error(sentence, EXIT_FAILED, getattr(error, "mistakes", ()))
    return EXIT_FAILED


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_more: Any
) -> None:
    text = warnings.formatwarning(message, category, filename, lineno)
    own = issubclass(category, DataWarning)
    print(f"multiradar: {message}" if own else text, file=sys.stderr)


def _print_error(sentence: str, status: int, mistakes: Sequence[str] = ()) -> int:
    # Empty where missing arguments requested help, which has been shown.
    if sentence:
        print(f"multiradar: {_one_line(sentence)}", file=sys.stderr)
    # A file with several mistakes: a line for each.
    for mistake in mistakes if len(mistakes) > 1 else ():
        print(f"  {_one_line(mistake)}", file=sys.stderr)
    return status


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _leave_broken_pipe() -> int:
    # The reader of standard output has gone; buffered data must not raise again at exit.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return EXIT_FAILED


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"multiradar {version('multiradar')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version and exit.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Joint estimation of aircraft tracks and radar biases."""
