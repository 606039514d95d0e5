"""Tables of the files that people write, and what is wrong with one as a whole."""

from pydantic_core import PydanticCustomError

from multiradar_schemas.base import Record
from multiradar_schemas.documents.explain import SENTENCE_ERROR


def wrong(sentence: str) -> PydanticCustomError:
    """Return the error of a table, as a sentence "expected …, was …"."""
    return PydanticCustomError(SENTENCE_ERROR, "{sentence}", {"sentence": sentence})


class Table(Record):
    """A table of a file; a key that it does not know is refused."""
