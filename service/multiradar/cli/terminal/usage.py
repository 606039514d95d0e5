"""Usage errors as one sentence: unknown names, wrong values, repeated options."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from multiradar_schemas.documents.names import did_you_mean, unknown

_CHOICE = re.compile(r"^'(?P<was>.*)' is not one of (?P<known>.*?)\.?$", re.DOTALL)
_COMMAND = re.compile(r"^No such command '(?P<was>.*?)'\.", re.DOTALL)
_EXTRA = re.compile(r"^Got unexpected extra argument\(s\) \((?P<was>.*)\)$", re.DOTALL)
_NUMBERS = {int: "a whole number", float: "a number"}


def check_arguments(arguments: Sequence[str], root: Any) -> None:
    """Reject usage errors that the option parser accepts.

    Parameters
    ----------
    arguments : sequence of str
        Arguments after the name of the program.
    root : command
        The root command.

    Raises
    ------
    typer.BadParameter
        An argument is empty or not UTF-8, or a single-valued option is given twice.
    """
    for argument in arguments:
        # Bytes that are not UTF-8 arrive as surrogates, which no report or table can hold.
        if any("\ud800" <= letter <= "\udfff" for letter in argument):
            raise typer.BadParameter(f"expected arguments in UTF-8, was {argument!r}")
    if "" in arguments:
        # Read as a path it would mean the working directory.
        before = arguments[: list(arguments).index("")]
        after = f" after {before[-1]!r}" if before else ""
        raise typer.BadParameter(f"empty argument{after} (an unset shell variable?)")
    for option in getattr(_command(arguments, root), "params", ()):
        given = [name for name in map(_name, _options(arguments)) if name in _names(option)]
        if len(given) > 1 and not option.multiple:
            named = " and ".join(dict.fromkeys(given))
            raise typer.BadParameter(f"{named}: given {len(given)} times, expected once")


def usage_sentence(error: Exception, arguments: Sequence[str], root: Any) -> str:
    """Return the message for a usage error.

    Parameters
    ----------
    error : Exception
        Error of the option parser or of a check.
    arguments : sequence of str
        Arguments after the name of the program.
    root : command
        The root command.

    Returns
    -------
    str
        One sentence; empty if the error only requests help.
    """
    sentence = str(error).removeprefix("Value error, ")
    command = _command(arguments, root)
    option = getattr(error, "param", None)
    if hasattr(error, "option_name"):
        return _of_option(sentence, error.option_name, command)
    if sentence.startswith("Missing parameter"):
        return f"missing {_called(option)}"
    if found := _COMMAND.match(sentence):
        return unknown("command", found["was"], getattr(error, "cmd", root).commands)
    if found := _EXTRA.match(sentence):
        return f"unexpected argument {found['was']!r}; quote names that contain spaces"
    if option is None or not _names(option):
        return sentence
    return f"{option.opts[0]}: {_of_value(sentence, option, arguments)}"


def _of_option(sentence: str, name: str, command: Any) -> str:
    known = [one for option in getattr(command, "params", ()) for one in _names(option)]
    if name in known:
        option = next(one for one in command.params if name in _names(one))
        return sentence if option.is_flag else f"missing value for {_called(option)}"
    near = did_you_mean(name, known)
    arguments = {one.name for one in getattr(command, "params", ()) if not _names(one)}
    if (plain := name.lstrip("-").replace("-", "_")) in arguments:
        near = f": {plain.upper()} is a positional argument; omit {name}"
    return f"unknown option '{name}'{near}; see --help"


def _of_value(sentence: str, option: Any, arguments: Sequence[str]) -> str:
    if choice := _CHOICE.match(sentence):
        what = option.opts[0].lstrip("-").replace("-", " ")
        return unknown(what, choice["was"], choice["known"].replace("'", "").split(", "))
    if not sentence.startswith("Input should be "):
        return sentence
    kind = _NUMBERS.get(option.type_descriptor.annotation)
    expected = sentence.removeprefix("Input should be ")
    if kind is not None:
        expected = f"{kind}{_bounds(option.min, option.max)}"
    was = _given(option, arguments)
    return f"expected {expected}" + ("" if was is None else f", was {was!r}")


def _bounds(least: float | None, most: float | None) -> str:
    if least is not None and most is not None:
        return f" from {_number(least)} to {_number(most)}"
    if least is not None:
        return f" of at least {_number(least)}"
    return "" if most is None else f" of at most {_number(most)}"


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.12g}"


def _called(option: Any) -> str:
    # As the help calls it.
    if not option.opts[0].startswith("-"):
        return f"argument {option.metavar or option.name.upper()}"
    value = option.metavar
    return f"option {option.opts[0]}{f' {value}' if value else ''}"


def _names(option: Any) -> list[str]:
    return [name for name in (*option.opts, *option.secondary_opts) if name.startswith("-")]


def _name(argument: str) -> str:
    return argument.partition("=")[0]


def _options(arguments: Sequence[str]) -> Iterable[str]:
    # Arguments after `--` are no options.
    for argument in arguments:
        if argument == "--":
            return
        if argument.startswith("--"):
            yield argument


def _given(option: Any, arguments: Sequence[str]) -> str | None:
    for index, argument in enumerate(arguments):
        name, equals, value = argument.partition("=")
        if name in _names(option):
            following = arguments[index + 1 : index + 2]
            return value if equals else next(iter(following), None)
    return None


def _command(arguments: Sequence[str], root: Any) -> Any:
    command = root
    for argument in arguments:
        if argument.startswith("-") or not hasattr(command, "commands"):
            break
        command = command.commands.get(argument, command)
    return command
