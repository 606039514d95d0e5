"""Frames of WebSocket messages that many clients get, encoded once."""

from collections.abc import Sequence

#: Member of an ASGI message `websocket.send`: a whole frame, which is sent as it is. A server that
#: reads it has the key in the `extensions` of the scope.
FRAME = "multiradar.frame"

# First octet of a frame that is a whole text, and lengths that stand for longer ones after them.
_FINAL_TEXT = b"\x81"
_LENGTH_16, _LENGTH_64 = 126, 127


def text_frame(parts: Sequence[bytes]) -> bytes:
    """Return a text as one WebSocket frame of a server, without mask (RFC 6455, section 5.2).

    Parameters
    ----------
    parts : sequence of bytes
        The text, UTF-8.
    """
    length = sum(map(len, parts))
    if length < _LENGTH_16:
        size = length.to_bytes(1, "big")
    elif length < 1 << 16:
        size = bytes([_LENGTH_16]) + length.to_bytes(2, "big")
    else:
        size = bytes([_LENGTH_64]) + length.to_bytes(8, "big")
    return b"".join([_FINAL_TEXT, size, *parts])
