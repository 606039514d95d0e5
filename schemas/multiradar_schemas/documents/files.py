"""Reads configuration files: TOML to a model, or a list of all errors."""

import difflib
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from multiradar_schemas.documents.contents import content, toml_content
from multiradar_schemas.documents.mistakes import mistakes_in
from multiradar_schemas.documents.toml_lines import Path, key_lines
from multiradar_schemas.errors import DocumentError

Model = TypeVar("Model", bound=BaseModel)


#: Octets at the start in which text has no zero, unless it is UTF-16.
_HEAD = 4096
_DECIMAL_COMMA = re.compile(r"^[^#\n]*=[ \t]*([-+]?\d+),(\d+)[ \t]*$", re.MULTILINE)
_TABLE = re.compile(r"^[ \t]*(\[\[?)[ \t]*([\w.-]+)[ \t]*\]", re.MULTILINE)
_AT_LINE = re.compile(r"\(at line (\d+), column \d+\)")
_BARE_TEXT = re.compile(r"^[^#=\"']*=[ \t]*([A-Za-z][\w.-]*)[ \t]*(?:#.*)?$")
#: Similarity of the name of a list and that of its tables.
_NEAR_MIN = 0.8
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True, slots=True)
class Document:
    """A parsed TOML file.

    Attributes
    ----------
    source : str
        Name in error messages.
    values : dict
        Its tables.
    lines : dict of tuple to int
        The line of each key, from 1; see `multiradar_schemas.documents.toml_lines`.
    """

    source: str
    values: dict[str, Any]
    lines: dict[Path, int]


def read_toml(path: FilePath) -> Document:
    """Read a TOML file.

    Returns
    -------
    Document
        Its tables.

    Raises
    ------
    DocumentError
        When the file cannot be read, is not UTF-8 or is not TOML.
    """
    try:
        # Some editors write a byte-order mark at the beginning.
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise DocumentError(str(path), "no such file") from error
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
        if path.is_dir():
            reason = f"expected a file, was {content(path) or 'a folder'}"
        raise DocumentError(str(path), reason) from error
    except UnicodeDecodeError as error:
        reason = f"not UTF-8 text (byte {error.start}); save the file as UTF-8"
        if b"\0" in error.object[:_HEAD] and error.object[:2] not in _UTF_16:
            reason = f"expected TOML, was {content(path) or 'binary'}"
        raise DocumentError(str(path), reason) from error
    try:
        return parse_toml(text, source=str(path))
    except DocumentError as error:
        found = content(path)
        if found is None:
            raise
        raise DocumentError(str(path), f"expected TOML, was {found}") from error


def parse_toml(text: str, *, source: str) -> Document:
    """Parse a TOML text; see `read_toml`."""
    try:
        values = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        hint = _hint(text, str(error)) or _hint_of(str(error))
        raise DocumentError(source, f"not valid TOML: {error}{hint}") from error
    return Document(source, values, key_lines(text))


# A decimal comma, text without quotes, or a table that is given again where several of its name
# belong in a list.
def _hint(text: str, message: str) -> str:
    comma = _DECIMAL_COMMA.search(text)
    if comma:
        return f"; write {comma[1]}.{comma[2]} for {comma[1]},{comma[2]}"
    bare = _bare_text(text, message)
    if bare:
        right = bare.lower() if bare in ("True", "False") else f'"{bare}"'
        return f"; write {right} for {bare}"
    return _hint_of_tables([(one[1], one[2]) for one in _TABLE.finditer(text)])


# Text without quotes in the line of the error.
def _bare_text(text: str, message: str) -> str:
    line = _AT_LINE.search(message)
    lines = text.split("\n")
    bare = _BARE_TEXT.search(lines[int(line[1]) - 1]) if line else None
    return bare[1] if bare else ""


def _hint_of_tables(headers: list[tuple[str, str]]) -> str:
    lists = [name for bracket, name in headers if bracket == "[["]
    seen: set[str] = set()
    for bracket, name in headers:
        first = name.partition(".")[0]
        if bracket == "[[" and name not in seen:
            # Each element of a list has tables of its own.
            seen = {one for one in seen if not one.startswith(f"{name}.")}
        elif name in seen and name != first and first in lists:
            return f"; [{name}] occurs twice in one [[{first}]]"
        elif name in seen:
            near = difflib.get_close_matches(first, lists, 1, _NEAR_MIN) if name != first else []
            wrong = f"[[{near[0]}]], as in [{name}]" if near else f"each [{name}]"
            return f"; write [[{first if near else name}]] for {wrong}"
        else:
            seen.add(name)
    return ""


def _hint_of(message: str) -> str:
    if not message.startswith("Cannot overwrite a value"):
        return ""
    return (
        "; the key is already in this table: a header such as [[sensor]] may be missing before it"
    )


def validated(
    model: type[Model], document: Document, wanted: str | None = None, *, key: str = "key"
) -> Model:
    """Validate a document against a model.

    Parameters
    ----------
    model : type
        The model.
    document : Document
        The document.
    wanted : str, optional
        What the document should be; see `multiradar_schemas.documents.contents`.
    key : str
        Name of a key in messages.

    Returns
    -------
    Model
        The validated values.

    Raises
    ------
    DocumentError
        With every invalid value: line, location, expected and actual value.
    """
    try:
        return model.model_validate(document.values)
    except ValidationError as error:
        found = toml_content(document.values)
        if wanted is not None and found not in (None, wanted):
            raise DocumentError(document.source, f"expected {wanted}, was {found}") from error
        reasons = mistakes_in(error, model, document.values, document.lines, key=key)
        raise DocumentError(document.source, *reasons) from error
