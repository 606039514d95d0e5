"""Tables of the files that people write: unknown keys and wrong wholes, told in one sentence."""

from typing import Any

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from multiradar_schemas.base import Record
from multiradar_schemas.explain import SENTENCE_ERROR, shown


def wrong(sentence: str) -> PydanticCustomError:
    """Return the error of a table, as a sentence "expected …, was …"."""
    return PydanticCustomError(SENTENCE_ERROR, "{sentence}", {"sentence": sentence})


class Table(Record):
    """A table of a file; a key that it does not know is refused with those that it does."""

    @model_validator(mode="before")
    @classmethod
    def _keys_are_known(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.model_fields:
                raise wrong(f"expected a key of {', '.join(cls.model_fields)}, was {shown(key)}")
        return data
