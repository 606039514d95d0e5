"""The work that the octets of one connection cause at once, and in proportion to their content.

A read delivers up to 256 KiB, which may be 43 000 chunks of a body or frames of a WebSocket. Of
these a pass of the event loop handles a few; the others wait for the next pass, in which other
connections have their turn. A connection with far more of them than content is ended.
"""

import h11
from uvicorn.protocols.http.flow_control import FlowControl

#: Parts of a request (its head, chunks of its body, its end) that a pass of the event loop handles.
EVENTS_OF_A_PASS = 32
#: Octets of a WebSocket that a pass handles: at most 42 frames.
WEBSOCKET_OCTETS_OF_A_PASS = 256
#: Chunks that any body may have, and octets of a body for which it may have a further one.
CHUNKS_FREE = 1024
OCTETS_PER_CHUNK = 64
#: Frames that a WebSocket may receive at once, and further ones per second.
FRAMES_FREE = 100
FRAMES_PER_S = 10.0


class PacedConnection(h11.Connection):
    """A parser of requests that pauses after some events, and counts chunks.

    Parameters
    ----------
    incomplete_octets_max : int
        Maximum size of an event that has not arrived completely.
    """

    def __init__(self, incomplete_octets_max: int) -> None:
        super().__init__(h11.SERVER, incomplete_octets_max)
        #: Events that this pass may still return.
        self.left = EVENTS_OF_A_PASS
        #: Whether the body has too many chunks; from then on no event is returned.
        self.too_many_chunks = False
        self._chunks = 0
        self._octets = 0

    def next_event(self) -> "h11.Event | type[h11.NEED_DATA] | type[h11.PAUSED]":
        """Return the next event; `NEED_DATA` also at the end of the pass."""
        if self.left == 0 or self.too_many_chunks:
            return h11.NEED_DATA
        event = super().next_event()
        if event is h11.NEED_DATA or event is h11.PAUSED:
            return event
        self.left -= 1
        if isinstance(event, h11.Request):
            self._chunks = self._octets = 0
        elif isinstance(event, h11.Data):
            self._chunks += event.chunk_start
            self._octets += len(event.data)
            allowed = CHUNKS_FREE + self._octets // OCTETS_PER_CHUNK
            self.too_many_chunks = self._chunks > allowed
        return event


class PacedFlow(FlowControl):
    """Flow control that does not read while events wait for the next pass."""

    #: Whether events wait.
    held = False

    def hold(self) -> None:
        """Do not read until `release`."""
        self.held = True
        self._transport.pause_reading()

    def release(self) -> None:
        """Read again, unless the application has enough of the body."""
        self.held = False
        if not self.read_paused:
            self._transport.resume_reading()

    def resume_reading(self) -> None:
        """Read again, unless events wait."""
        if self.held:
            self.read_paused = False
        else:
            super().resume_reading()


class FrameAllowance:
    """The frames that a WebSocket may receive: some at once, and a number per second."""

    def __init__(self) -> None:
        self._left = float(FRAMES_FREE)
        self._since_s: float | None = None

    def spend(self, frames: int, now_s: float) -> bool:
        """Count frames at a time, s; return False if they are too many."""
        if self._since_s is not None:
            self._left += (now_s - self._since_s) * FRAMES_PER_S
        self._left = min(self._left, float(FRAMES_FREE)) - frames
        self._since_s = now_s
        return self._left >= 0.0
