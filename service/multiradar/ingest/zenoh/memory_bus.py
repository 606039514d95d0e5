"""A bus in memory, the twin of the Zenoh session for tests."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from multiradar.ingest.zenoh.bus import JSON, BusCounts, Message, Request


@dataclass(slots=True)
class MemoryAnswer:
    """What a query got.

    Attributes
    ----------
    replies : list of tuple
        Key, payload and attachment of each answer.
    errors : list of bytes
        Payload of each error.
    finished : int
        How often it was finished; 1 when all is well.
    """

    replies: list[tuple[str, bytes, bytes]] = field(default_factory=list)
    errors: list[bytes] = field(default_factory=list)
    finished: int = 0


class MemoryStream:
    """Keeps the last updates, and whether each was sent."""

    def __init__(self, bus: "MemoryBus", key: str, depth: int) -> None:
        self._bus = bus
        self._key = key
        self.kept: deque[bytes] = deque(maxlen=depth)
        self.closed = False

    def send(self, payload: bytes, attachment: bytes) -> None:
        """Send an update, and keep it."""
        self.kept.append(payload)
        self._bus.put(self._key, payload, attachment)

    def remember(self, payload: bytes, attachment: bytes) -> None:
        """Keep an update without sending it."""
        del attachment
        self.kept.append(payload)

    def close(self) -> None:
        """Forget what was kept."""
        self.kept.clear()
        self.closed = True


class MemoryBus:
    """Inlet and outlet in one process; handlers run in the thread that calls."""

    def __init__(self) -> None:
        self.counts = BusCounts()
        self.instance = "memory"
        self.endpoints: tuple[str, ...] = ()
        self.announced = False
        self.closed = False
        self.sent: list[Message] = []
        self.streams: dict[str, MemoryStream] = {}
        self.watchers: list[Callable[[], None]] = []
        self._subscribers: list[tuple[str, Callable[[Message], None]]] = []
        self._queryables: list[tuple[str, Callable[[Request], None]]] = []

    def announce(self) -> None:
        """Note that the instance announced itself."""
        self.announced = True

    def subscribe(self, key: str, handler: Callable[[Message], None]) -> None:
        """Have a handler called with each sample on a key expression."""
        self._subscribers.append((key, handler))

    def answer(self, key: str, handler: Callable[[Request], None]) -> None:
        """Have a handler called with each query on a key expression."""
        self._queryables.append((key, handler))

    def watch(self, handler: Callable[[], None]) -> None:
        """Have a handler called when a test says that somebody connects."""
        self.watchers.append(handler)

    def put(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Note a sample that was sent."""
        self.sent.append(Message(key, payload, JSON, attachment))

    def stream(self, key: str, depth: int, heartbeat_s: float) -> MemoryStream:
        """Return a stream of updates that keeps the last `depth`."""
        del heartbeat_s
        self.streams[key] = MemoryStream(self, key, depth)
        return self.streams[key]

    def close(self) -> None:
        """Note that the session is no longer needed."""
        self.closed = True

    def deliver(self, message: Message) -> None:
        """Let a sample come in."""
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
        """Let a query come in, and return where its answers will be."""
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
            refuse=answer.errors.append,
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
            request.refuse(b'{"code":"INTERNAL","reason":"the query failed"}')
            request.finish()


def _covers(expression: str, key: str) -> bool:
    # Enough of the key expressions: `*` in the last place, `**` at the end.
    if expression.endswith("/**"):
        return key.startswith(expression[:-2]) or key == expression[:-3]
    return expression.count("/") == key.count("/") and fnmatchcase(key, expression)
