"""Errors of the converters.

::

    ConversionError             a recording that cannot be converted
    ├── ProfileError            a dump profile that cannot be used
    ├── LayoutError             a file that does not match its layout
    ├── OutputFolderExistsError the output folder exists already
    └── AccountingError         counts do not add up: a bug of the converter
"""


class ConversionError(Exception):
    """A recording cannot be converted."""


class ProfileError(ConversionError):
    """A dump profile cannot be used; for a file with `source` and a message for each error."""

    def __init__(self, sentence: str, source: str = "", reasons: tuple[str, ...] = ()) -> None:
        self.source = source
        self.reasons = reasons
        super().__init__(sentence)


class LayoutError(ConversionError):
    """A file does not match its layout."""


class OutputFolderExistsError(ConversionError):
    """The output folder exists already; it was not changed."""


class AccountingError(ConversionError):
    """Records read are not accepted + rejected + blank: a bug of the converter."""
