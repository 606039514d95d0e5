"""The command `multiradar`: verbs, one sentence on errors, exit status 0, 1 or 2."""

import os
import re
import sys
from collections.abc import Iterable, Sequence
from typing import Annotated

import typer

from multiradar.cli.convert import convert_app
from multiradar.cli.convert_adsb import ADSB_HELP, convert_adsb
from multiradar.cli.convert_asterix import ASTERIX_HELP, convert_asterix
from multiradar.cli.demo import demo
from multiradar.cli.evaluate import evaluate
from multiradar.cli.replay import replay
from multiradar.cli.serve import serve
from multiradar.cli.simulate import simulate
from multiradar.cli.stopping import EXIT_INTERRUPTED, end_on_signals, leave
from multiradar.cli.study import study_command, study_help
from multiradar.cli.track import track
from multiradar.cli.warm_up import warm_up
from multiradar.errors import MultiradarError, UnknownFilterError
from multiradar.studies.catalogue import STUDIES

EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_USAGE = 2

#: Set to 1 to see the traceback of an error that is our own mistake.
TRACEBACK_VARIABLE = "MULTIRADAR_TRACEBACK"

_CHOICE = re.compile(r"^'(?P<was>.*)' is not one of (?P<known>.*?)\.?$")


app = typer.Typer(
    name="multiradar",
    help="Joint estimation of aircraft tracks and radar biases.",
    epilog="Exit status: 0 done, 1 failed on the data, 2 usage error.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
convert_app.command(name="asterix", help=ASTERIX_HELP)(convert_asterix)
convert_app.command(name="adsb", help=ADSB_HELP)(convert_adsb)
app.add_typer(convert_app, name="convert")
app.command(name="track")(track)
app.command(name="serve")(serve)
app.command(name="replay")(replay)
app.command(name="demo")(demo)
app.command(name="simulate")(simulate)
app.command(name="evaluate")(evaluate)
app.command(name="warm-up")(warm_up)
app.command(name="study", help=study_help(STUDIES))(study_command(STUDIES))


def main(commands: typer.Typer = app) -> None:
    """Run the command of this process's arguments and leave with its exit status."""
    end_on_signals()
    status = run(sys.argv[1:], commands)
    if status == EXIT_INTERRUPTED:
        leave(status)
    sys.exit(status)


def run(arguments: Sequence[str], commands: typer.Typer = app) -> int:
    """Run one command and return its exit status.

    Parameters
    ----------
    arguments : sequence of str
        What follows the name of the program.
    commands : typer.Typer
        The commands there are.

    Returns
    -------
    int
        0 done, 1 failed on data, 2 wrong usage, 130 stopped by Ctrl-C.
    """
    try:
        return _invoke(arguments, commands)
    except BrokenPipeError:
        return _leave_broken_pipe()
    except (KeyboardInterrupt, typer.Abort):
        return EXIT_INTERRUPTED
    except (typer.TyperException, UnknownFilterError) as error:
        return _say(_usage(error), EXIT_USAGE)
    except (MultiradarError, OSError) as error:
        return _say(_describe(error), EXIT_FAILED)
    except Exception as error:
        if os.environ.get(TRACEBACK_VARIABLE) == "1":
            raise
        hint = f"set {TRACEBACK_VARIABLE}=1 to see where"
        return _say(f"internal error, {type(error).__name__}: {error} ({hint})", EXIT_FAILED)


def _invoke(arguments: Sequence[str], commands: typer.Typer) -> int:
    for argument in arguments:
        # Octets that are no UTF-8 come as half characters, which no report and no table can hold.
        if any("\ud800" <= letter <= "\udfff" for letter in argument):
            raise typer.BadParameter(f"expected arguments in UTF-8, was {argument!r}")
    command = typer.main.get_command(commands)
    status = command.main(args=list(arguments), prog_name="multiradar", standalone_mode=False)
    sys.stdout.flush()
    return status if isinstance(status, int) else EXIT_DONE


def _usage(error: Exception) -> str:
    # A value that an option's type refuses is told without the name of the option.
    options = getattr(getattr(error, "param", None), "opts", ())
    sentence = str(error).removeprefix("Value error, ")
    if options and sentence.startswith("Missing parameter"):
        return f"expected a value for {options[0]}, was none"
    sentence = _expectation(sentence, getattr(getattr(error, "cmd", None), "commands", {}))
    return f"{options[0]}: {sentence}" if options else sentence


def _expectation(sentence: str, commands: Iterable[str]) -> str:
    if choice := _CHOICE.match(sentence):
        known = choice["known"].replace("'", "")
        return f"expected one of {known}, was {choice['was']!r}"
    if sentence.startswith("Input should be "):
        return f"expected {sentence.removeprefix('Input should be ')}"
    if sentence.startswith("No such command "):
        was = sentence.removeprefix("No such command ").rstrip(".")
        return f"expected a command of {', '.join(commands)}, was {was}"
    return sentence


def _say(sentence: str, status: int) -> int:
    # Nothing is said where help was asked for by saying nothing, and has been given.
    if sentence:
        one_line = " ".join(sentence.split())
        print(f"multiradar: {one_line}", file=sys.stderr)
    return status


def _describe(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error) or type(error).__name__


def _leave_broken_pipe() -> int:
    # The reader of our output has gone; what is still buffered must not raise again at exit.
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
