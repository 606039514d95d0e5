"""Interface to Zenoh: input and output protocols and their messages."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Protocol

JSON = "application/json"


@dataclass(frozen=True, slots=True)
class Message:
    """A received sample.

    Attributes
    ----------
    key : str
        Its key.
    payload : bytes
        Its content.
    media_type : str
        The encoding declared by the sender.
    attachment : bytes
        The attachment; empty when absent.
    """

    key: str
    payload: bytes
    media_type: str
    attachment: bytes = b""


@dataclass(frozen=True, slots=True)
class Request:
    """A received query; it must be finished exactly once.

    Attributes
    ----------
    key : str
        Key expression; may have wildcards.
    parameters : mapping
        Parameters after the question mark.
    payload : bytes or None
        Its content.
    media_type : str
        Encoding of the content.
    attachment : bytes
        The attachment; empty when absent.
    reply : callable
        Sends an answer: key, payload, attachment.
    reply_error : callable
        Sends an error: payload.
    finish : callable
        Ends the query.
    repeated : tuple of str
        Names of repeated parameters; the mapping has the last value of each.
    """

    key: str
    parameters: Mapping[str, str]
    payload: bytes | None
    media_type: str
    attachment: bytes
    reply: Callable[[str, bytes, bytes], None]
    reply_error: Callable[[bytes], None]
    finish: Callable[[], None]
    repeated: tuple[str, ...] = ()


def wrong_parameters(request: Request, known: Collection[str]) -> tuple[str, str] | None:
    """Return the error in the parameter names of a query.

    Parameters
    ----------
    request : Request
        The query. Names that begin with an underscore are Zenoh's own.
    known : collection of str
        Allowed names, each at most once.

    Returns
    -------
    tuple of str, or None
        Code and reason, as over HTTP; None without an error.
    """
    unknown = [one for one in request.parameters if one not in known and not one.startswith("_")]
    if unknown:
        shown = ", ".join(ascii(name)[1:-1][:64] for name in unknown[:8])
        expected = f"one of {', '.join(sorted(known))}" if known else "no parameters"
        return "UNKNOWN_PARAMETER", f"expected {expected}, was {shown}"
    repeated = [name for name in request.repeated if name in known]
    if repeated:
        return "INVALID_PARAMETER", "; ".join(f"{name}: expected once" for name in repeated)
    return None


class Stream(Protocol):
    """The updates of one track or sensor, with a cache for late subscribers."""

    def send(self, payload: bytes, attachment: bytes) -> None:
        """Publish and cache an update; never waits for a subscriber."""
        ...

    def cache(self, payload: bytes, attachment: bytes) -> None:
        """Cache an update without publishing it."""
        ...

    def close(self) -> None:
        """Discard the cache."""
        ...


class Inlet(Protocol):
    """Input. Handlers are called in threads of the bus; their exceptions are reported."""

    def subscribe(self, key: str, handler: Callable[[Message], None]) -> None:
        """Call a handler with each sample on a key expression."""
        ...

    def answer(self, key: str, handler: Callable[[Request], None]) -> None:
        """Call a handler with each query on a key expression."""
        ...

    def watch(self, handler: Callable[[], None]) -> None:
        """Call a handler whenever another session connects to this one."""
        ...


class Outlet(Protocol):
    """Output."""

    def put(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Publish a JSON sample; never waits for a subscriber."""
        ...

    def stream(self, key: str, depth: int, heartbeat_s: float) -> Stream:
        """Return a stream of updates that caches the last `depth`."""
        ...


@dataclass(slots=True)
class BusCounts:
    """Errors inside the bus.

    Attributes
    ----------
    handler_errors : int
        Handlers that raised an exception: bugs.
    last_error : str
        The last of them.
    """

    handler_errors: int = 0
    last_error: str = field(default="")

    def report(self, error: BaseException) -> None:
        """Count an error that must not reach the threads of the bus."""
        self.handler_errors += 1
        self.last_error = f"{type(error).__name__}: {error}"[:200]
