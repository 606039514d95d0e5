"""An error as one sentence."""

from tempfile import gettempdir

from multiradar.errors import ConfigurationError, MultiradarError
from multiradar.settings.variables import TRACEBACK_VARIABLE
from multiradar.storage.full_disk import is_full


def error_sentence(error: Exception) -> str:
    """Return an error as one sentence for the user.

    Parameters
    ----------
    error : Exception
        One of this project, of the system, or an internal one.
    """
    if isinstance(error, ConfigurationError) and len(error.mistakes) > 1:
        return f"{error.source}: {len(error.mistakes)} errors"
    if is_full(error) and getattr(error, "filename", None) is None:
        return (
            f"no space left on device for the output or for temporary files in {gettempdir()} "
            "(set TMPDIR to use another folder for temporary files)"
        )
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if not isinstance(error, MultiradarError | OSError):
        hint = f"set {TRACEBACK_VARIABLE}=1 for a traceback"
        return f"internal error, {type(error).__name__}: {error} ({hint})"
    return str(error) or type(error).__name__
