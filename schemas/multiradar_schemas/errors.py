"""The errors of reading what others wrote.

::

    SchemaError                 a document that cannot be used, told in one sentence
    ├── DocumentError           a file with a value that is not what the model expects
    └── BodyError               a whole message that cannot be read, with its reject code
"""

from multiradar_schemas.reject import RejectCode


class SchemaError(ValueError):
    """A document that somebody else wrote cannot be used."""


class DocumentError(SchemaError):
    """A file holds a value that is not what its model expects."""

    def __init__(self, source: str, reason: str) -> None:
        self.source = source
        self.reason = reason
        super().__init__(f"{source}: {reason}")


class BodyError(SchemaError):
    """A whole message cannot be read; none of its rows was taken."""

    def __init__(self, code: RejectCode, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(reason)
