"""A bus in memory, for tests."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from multiradar.ingest.zenoh.bus import JSON, BusCounts, Message, Request


@dataclass(slots=True)
class MemoryAnswer:
    """Answers to a query.

    Attributes
    ----------
    replies : list of tuple
        Key, payload and attachment of each answer.
    errors : list of bytes
        Payload of each error.
    finished : int
        How often it was finished; expected 1.
    """

    replies: list[tuple[str, bytes, bytes]] = field(default_factory=list)
    errors: list[bytes] = field(default_factory=list)
    finished: int = 0


class MemoryStream:
    """Keeps the last updates, and whether each was published."""

    def __init__(self, bus: "MemoryBus", key: str, depth: int) -> None:
        self._bus = bus
        self._key = key
        self.kept: deque[bytes] = deque(maxlen=depth)
        self.closed = False

    def send(self, payload: bytes, attachment: bytes) -> None:
        """Publish and cache an update."""
        self.kept.append(payload)
        self._bus.put(self._key, payload, attachment)

    def cache(self, payload: bytes, attachment: bytes) -> None:
        """Cache an update without publishing it."""
        del attachment
        self.kept.append(payload)

    def close(self) -> None:
        """Discard the cache."""
        self.kept.clear()
        self.closed = True


class MemoryBus:
    """Inlet and outlet in one process; handlers run in the calling thread."""

    def __init__(self) -> None:
        self.counts = BusCounts()
        self.instance = "memory"
        self.endpoints: tuple[str, ...] = ()
        self.links = 0
        self.unreachable: tuple[str, ...] = ()
        self.announced = False
        self.closed = False
        self.sent: list[Message] = []
        self.streams: dict[str, MemoryStream] = {}
        self.watchers: list[Callable[[], None]] = []
        self._subscribers: list[tuple[str, Callable[[Message], None]]] = []
        self._queryables: list[tuple[str, Callable[[Request], None]]] = []

    def announce(self) -> None:
        """Record that the instance announced itself."""
        self.announced = True

    def subscribe(self, key: str, handler: Callable[[Message], None]) -> None:
        """Call a handler with each sample on a key expression."""
        self._subscribers.append((key, handler))

    def answer(self, key: str, handler: Callable[[Request], None]) -> None:
        """Call a handler with each query on a key expression."""
        self._queryables.append((key, handler))

    def watch(self, handler: Callable[[], None]) -> None:
        """Call a handler when a test simulates a connection."""
        self.watchers.append(handler)

    def put(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Record a published sample."""
        self.sent.append(Message(key, payload, JSON, attachment))

    def stream(self, key: str, depth: int, heartbeat_s: float) -> MemoryStream:
        """Return a stream of updates that caches the last `depth`."""
        del heartbeat_s
        self.streams[key] = MemoryStream(self, key, depth)
        return self.streams[key]

    def close(self) -> None:
        """Record the end of the session."""
        self.closed = True

    def deliver(self, message: Message) -> None:
        """Deliver a sample."""
        for key, handler in self._subscribers:
            if _covers(key, message.key):
                try:
                    handler(message)
                except Exception as error:
                    self.counts.report(error)

    def ask(
        self,
        key: str,
        *,
        parameters: Mapping[str, str] | None = None,
        payload: bytes | None = None,
        media_type: str = JSON,
        attachment: bytes = b"",
    ) -> MemoryAnswer:
        """Deliver a query; return the object that collects its answers."""
        answer = MemoryAnswer()

        def finish() -> None:
            answer.finished += 1

        request = Request(
            key=key,
            parameters=dict(parameters or {}),
            payload=payload,
            media_type=media_type,
            attachment=attachment,
            reply=lambda *parts: answer.replies.append(parts),
            reply_error=answer.errors.append,
            finish=finish,
        )
        for served, handler in self._queryables:
            if _covers(served, key) or _covers(key, served):
                self._asked(handler, request)
        return answer

    def _asked(self, handler: Callable[[Request], None], request: Request) -> None:
        try:
            handler(request)
        except Exception as error:
            self.counts.report(error)
            request.reply_error(b'{"code":"INTERNAL","reason":"the query failed"}')
            request.finish()


def _covers(expression: str, key: str) -> bool:
    # The part of the key expressions that tests need: `*` as last part, `**` at the end.
    if expression.endswith("/**"):
        return key.startswith(expression[:-2]) or key == expression[:-3]
    return expression.count("/") == key.count("/") and fnmatchcase(key, expression)
