"""Reading of files that people write: TOML in, a model out, or one clear sentence."""

import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from multiradar_schemas.errors import DocumentError
from multiradar_schemas.explain import explain

Model = TypeVar("Model", bound=BaseModel)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        Its tables.

    Raises
    ------
    DocumentError
        When the file cannot be read, is not UTF-8 or is no TOML.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise DocumentError(str(path), f"expected a file, was: {error.strerror}") from error
    except UnicodeDecodeError as error:
        reason = f"expected UTF-8 text, was another encoding at byte {error.start}"
        raise DocumentError(str(path), reason) from error
    return parse_toml(text, source=str(path))


def parse_toml(text: str, *, source: str) -> dict[str, Any]:
    """Return the tables of a TOML text; see `read_toml`."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise DocumentError(source, f"expected TOML, was not: {error}") from error


def validated(model: type[Model], values: dict[str, Any], *, source: str) -> Model:
    """Return values as a model.

    Parameters
    ----------
    model : type
        The model.
    values : dict
        What was read.
    source : str
        Name of the file, for the sentence.

    Returns
    -------
    Model
        The values, checked.

    Raises
    ------
    DocumentError
        At the first wrong value; the sentence names its place, what was expected and what it was.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        _, reason = explain(error.errors(include_url=False)[0])
        raise DocumentError(source, reason) from error
