"""What the converters say no to.

::

    ConversionError             a recording that cannot be converted
    ├── ProfileError            a dump profile that cannot be used
    ├── LayoutError             a file that is not laid out as its profile says
    ├── OutputTakenError        the place to write to is taken
    └── AccountingError         what was read does not add up: our own mistake, told loudly
"""


class ConversionError(Exception):
    """A recording cannot be converted, told in one sentence."""


class ProfileError(ConversionError):
    """A dump profile cannot be used; of a file with `source` and a sentence for each mistake."""

    def __init__(self, sentence: str, source: str = "", reasons: tuple[str, ...] = ()) -> None:
        self.source = source
        self.reasons = reasons
        super().__init__(sentence)


class LayoutError(ConversionError):
    """A file is not laid out as its profile says."""


class OutputTakenError(ConversionError):
    """The place to write to is taken; nothing there was touched."""


class AccountingError(ConversionError):
    """What was read is not what was accepted, rejected and blank: the converter is wrong."""
