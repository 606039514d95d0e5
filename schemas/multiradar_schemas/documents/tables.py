"""Tables of configuration files, and errors of a whole table."""

from pydantic_core import PydanticCustomError

from multiradar_schemas.base import Record
from multiradar_schemas.documents.explain import SENTENCE_ERROR


def wrong(sentence: str) -> PydanticCustomError:
    """Return the error of a table with a message "expected …, was …"."""
    return PydanticCustomError(SENTENCE_ERROR, "{sentence}", {"sentence": sentence})


class Table(Record):
    """A table of a file; unknown keys are rejected."""
