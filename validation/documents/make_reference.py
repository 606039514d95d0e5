"""Generates the reference pages of the commands and the HTTP operations from the code.

::

    python -m validation.documents.make_reference docs/reference
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import typer
from rich.text import Text

from multiradar.api.factory import create_api
from multiradar.cli.main import app
from multiradar.ingest.http import IntakeBounds, measurement_routes

_PLACES = {"path": "in the path", "query": "in the query", "header": "in a header"}


def commands_page() -> str:
    """Return the page of all commands: purposes, arguments and options with defaults."""
    lines = ["# Commands", "", "`--help` of a command shows the same."]
    root = typer.main.get_command(app)
    for name, command in _leaves(root, "multiradar"):
        lines += ["", f"## `{name}`", "", _plain(command.help)]
        context = command.context_class(command, info_name=name)
        for parameter in command.params:
            if parameter.name != "help" and (record := parameter.get_help_record(context)):
                lines += ["", f"`{record[0]}`", f": {_plain(record[1])}"]
    return "\n".join([*lines, "", _plain(root.epilog)]) + "\n"


# Typer has its own form of these classes, which it does not export.
def _leaves(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    for own, one in getattr(command, "commands", {}).items():
        yield from _leaves(one, f"{name} {own}")
    if not hasattr(command, "commands") and not command.hidden:
        yield name, command


# Markup for the terminal is for the terminal; angle brackets would be tags on a page.
def _plain(text: str | None) -> str:
    return Text.from_markup((text or "").replace("\b", "")).plain.replace("<", "&lt;").strip()


def http_page(openapi: Mapping[str, Any]) -> str:
    """Return the page of all HTTP operations: parameters, answers and error codes.

    Parameters
    ----------
    openapi : mapping
        The OpenAPI document.
    """
    lines = ["# HTTP operations", "", "Generated from the OpenAPI document, `GET /openapi.json`."]
    for path, operations in openapi["paths"].items():
        for verb, operation in operations.items():
            lines += ["", f"## `{verb.upper()} {path}`", "", operation["description"].strip()]
            for parameter in operation.get("parameters", ()):
                lines += _query_parameter(parameter)
            lines += ["", "| status | response |", "|---|---|"]
            lines += [
                f"| {status} | {' '.join(answer['description'].split())} |"
                for status, answer in sorted(operation["responses"].items())
            ]
    return "\n".join(lines) + "\n"


def _query_parameter(parameter: Mapping[str, Any]) -> list[str]:
    place = _PLACES[parameter["in"]]
    need = ", required" if parameter.get("required") else ""
    text = " ".join(parameter.get("description", "").split())
    return ["", f"`{parameter['name']}` ({place}{need})", f": {text or 'See the user guide.'}"]


def openapi() -> dict[str, Any]:
    """Return the OpenAPI document, which does not depend on what the service knows."""
    service = Mock()
    return create_api(service, routers=[measurement_routes(service, IntakeBounds())]).openapi()


def main(arguments: Sequence[str] | None = None) -> None:
    """Write both pages into a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the pages are written")
    folder: Path = parser.parse_args(arguments).folder
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "commands.md").write_text(commands_page(), encoding="utf-8")
    (folder / "http.md").write_text(http_page(openapi()), encoding="utf-8")


if __name__ == "__main__":
    main()
