"""The errors of reading what others wrote.

::

    SchemaError                 a document that cannot be used, told in one sentence
    ├── DocumentError           a file with a value that is not what the model expects
    └── BodyError               a whole message that cannot be read, with its reject code
"""

from multiradar_schemas.measurements.reject import RejectCode


class SchemaError(ValueError):
    """A document that somebody else wrote cannot be used."""


class DocumentError(SchemaError):
    """A file holds values that are not what its model expects.

    Attributes
    ----------
    source : str
        The file.
    reasons : tuple of str
        A sentence for each mistake.
    """

    def __init__(self, source: str, *reasons: str) -> None:
        self.source = source
        self.reasons = reasons
        many = f"{len(reasons)} mistakes: " if len(reasons) > 1 else ""
        super().__init__(f"{source}: {many}{'; '.join(reasons)}")


class BodyError(SchemaError):
    """A whole message cannot be read; none of its rows was taken."""

    def __init__(self, code: RejectCode, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(reason)
