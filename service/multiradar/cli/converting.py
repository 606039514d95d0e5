"""What all conversions show and tell, whatever they read."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from multiradar.cli.progress import progress_bar
from multiradar.errors import InputError, OutputExistsError


@contextmanager
def conversion_faults() -> Iterator[None]:
    """Raise what goes wrong in a conversion as commands do.

    Raises
    ------
    OutputExistsError
        The folder to make exists; nothing was touched.
    InputError
        What is converted cannot be read; the folder to make does not exist.
    """
    # Not at the head of the module: help must be fast.
    from multiradar_converters.errors import ConversionError, OutputTakenError

    try:
        yield
    except OutputTakenError as error:
        raise OutputExistsError(str(error)) from error
    except ConversionError as error:
        raise InputError(str(error)) from error


@contextmanager
def bytes_bar(total: int) -> Iterator[Callable[[int], None]]:
    """Show how much is converted.

    Parameters
    ----------
    total : int
        Bytes in all.

    Yields
    ------
    callable
        To be told the bytes that were read since it was told last.
    """
    with progress_bar("converting", total) as show:
        done = 0

        def advance(read: int) -> None:
            nonlocal done
            done += read
            show(done)

        yield advance
