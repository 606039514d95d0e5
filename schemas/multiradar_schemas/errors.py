"""Errors in external documents.

::

    SchemaError                 an unusable document
    ├── DocumentError           a file with invalid values
    └── BodyError               an unreadable message, with its reject code
"""

from multiradar_schemas.reject import RejectCode


class SchemaError(ValueError):
    """An external document cannot be used."""


class DocumentError(SchemaError):
    """A file has values that its model does not accept.

    Attributes
    ----------
    source : str
        The file.
    reasons : tuple of str
        A message for each error.
    """

    def __init__(self, source: str, *reasons: str) -> None:
        self.source = source
        self.reasons = reasons
        many = f"{len(reasons)} mistakes: " if len(reasons) > 1 else ""
        super().__init__(f"{source}: {many}{'; '.join(reasons)}")


class BodyError(SchemaError):
    """A message cannot be read; none of its rows was accepted."""

    def __init__(self, code: RejectCode, reason: str) -> None:
        self.code = code
        self.reason = reason
        super().__init__(reason)
