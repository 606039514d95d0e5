"""Output that was written although its input is at fault: first it is shown, then the findings."""

from collections.abc import Callable
from typing import TypeVar, cast

from multiradar.errors import FindingsError

Output = TypeVar("Output")


def with_findings(make: Callable[[], Output]) -> tuple[Output, FindingsError | None]:
    """Return what a function makes, with its findings if it raises them.

    Returns
    -------
    output, FindingsError or None
        The output, and the error to raise when it has been shown.
    """
    try:
        return make(), None
    except FindingsError as error:
        return cast("Output", error.output), error
