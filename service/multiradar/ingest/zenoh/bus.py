"""What the service needs of Zenoh: two small interfaces, and the messages that pass them."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Protocol

JSON = "application/json"


@dataclass(frozen=True, slots=True)
class Message:
    """A sample that came in.

    Attributes
    ----------
    key : str
        Key under which it was put.
    payload : bytes
        Its content.
    media_type : str
        The encoding as the sender named it.
    attachment : bytes
        What was attached; empty when nothing was.
    """

    key: str
    payload: bytes
    media_type: str
    attachment: bytes = b""


@dataclass(frozen=True, slots=True)
class Request:
    """A query that came in; it must be finished exactly once.

    Attributes
    ----------
    key : str
        Key expression that was asked for; may have wildcards.
    parameters : mapping
        What followed the question mark.
    payload : bytes or None
        Content that came with it.
    media_type : str
        Encoding of the content.
    attachment : bytes
        What was attached; empty when nothing was.
    reply : callable
        Sends an answer: key, payload, attachment.
    refuse : callable
        Sends an error: payload.
    finish : callable
        Ends the query.
    repeated : tuple of str
        Names of parameters that are given more than once; the mapping has the last value of each.
    """

    key: str
    parameters: Mapping[str, str]
    payload: bytes | None
    media_type: str
    attachment: bytes
    reply: Callable[[str, bytes, bytes], None]
    refuse: Callable[[bytes], None]
    finish: Callable[[], None]
    repeated: tuple[str, ...] = ()


def wrong_parameters(request: Request, known: Collection[str]) -> tuple[str, str] | None:
    """Return what is wrong with the names of a query's parameters.

    Parameters
    ----------
    request : Request
        The query. Names that begin with an underscore are Zenoh's own.
    known : collection of str
        Names that it may have, each once.

    Returns
    -------
    tuple of str, or None
        Code and reason, as over HTTP; None when nothing is wrong.
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
    """The updates of one track or sensor, with a cache for those who come late."""

    def send(self, payload: bytes, attachment: bytes) -> None:
        """Send an update to whoever listens, and keep it; never waits for a subscriber."""
        ...

    def remember(self, payload: bytes, attachment: bytes) -> None:
        """Keep an update without sending it."""
        ...

    def close(self) -> None:
        """Forget what was kept."""
        ...


class Inlet(Protocol):
    """What comes in. Handlers are called in threads of the bus; what they raise is reported."""

    def subscribe(self, key: str, handler: Callable[[Message], None]) -> None:
        """Have a handler called with each sample on a key expression."""
        ...

    def answer(self, key: str, handler: Callable[[Request], None]) -> None:
        """Have a handler called with each query on a key expression."""
        ...

    def watch(self, handler: Callable[[], None]) -> None:
        """Have a handler called whenever another session connects to this one."""
        ...


class Outlet(Protocol):
    """What goes out."""

    def put(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Send a JSON sample to whoever listens now; never waits for a subscriber."""
        ...

    def stream(self, key: str, depth: int, heartbeat_s: float) -> Stream:
        """Return a stream of updates that keeps the last `depth`."""
        ...


@dataclass(slots=True)
class BusCounts:
    """What went wrong inside the bus.

    Attributes
    ----------
    handler_errors : int
        Handlers that raised: a fault of this program.
    last_error : str
        The last of them.
    """

    handler_errors: int = 0
    last_error: str = field(default="")

    def report(self, error: BaseException) -> None:
        """Count an error that must not reach the threads of the bus."""
        self.handler_errors += 1
        self.last_error = f"{type(error).__name__}: {error}"[:200]
