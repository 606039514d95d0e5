"""Destinations of blocks: datagrams to a host or a multicast group, or a file."""

import contextlib
from collections.abc import Sequence
from typing import BinaryIO, Protocol

from multiradar.errors import ConfigurationError
from multiradar.ingest.udp import open_sending
from multiradar.settings.asterix_output import AsterixOutputSettings


class Sink(Protocol):
    """Writes blocks without ever waiting for a reader."""

    def send(self, blocks: Sequence[bytes]) -> int:
        """Send blocks; return the number sent."""
        ...

    def close(self) -> None:
        """Release the destination."""
        ...


class MemorySink:
    """Keeps blocks in memory: for tests."""

    def __init__(self) -> None:
        self.blocks: list[bytes] = []

    def send(self, blocks: Sequence[bytes]) -> int:
        """Keep blocks."""
        self.blocks += blocks
        return len(blocks)

    def close(self) -> None:
        """Keep what there is."""


class DatagramSink:
    """Sends each block as a datagram.

    Parameters
    ----------
    settings : AsterixOutputSettings
        Address, port, interface and time to live.

    Raises
    ------
    ConfigurationError
        If there is no such interface.
    """

    def __init__(self, settings: AsterixOutputSettings) -> None:
        assert settings.port is not None
        self._target = settings.address, settings.port
        try:
            self._socket = open_sending(
                settings.address,
                settings.interface,
                ttl=settings.ttl,
                buffer_octets=settings.send_buffer_octets,
            )
        except OSError as error:
            msg = (
                f"ASTERIX output {settings.label}: cannot send via {settings.interface}: "
                f"{error.strerror or error}"
            )
            raise ConfigurationError(msg) from error
        self._socket.setblocking(False)

    def send(self, blocks: Sequence[bytes]) -> int:
        """Send blocks; those that do not fit the buffer or have no route are dropped."""
        sent = 0
        for block in blocks:
            with contextlib.suppress(OSError):
                self._socket.sendto(block, self._target)
                sent += 1
        return sent

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class FileSink:
    """Appends blocks to a file.

    Parameters
    ----------
    settings : AsterixOutputSettings
        The file; existing content is kept.

    Raises
    ------
    ConfigurationError
        If it cannot be written to.
    """

    def __init__(self, settings: AsterixOutputSettings) -> None:
        assert settings.file is not None
        if settings.file.is_fifo():
            # Opening a pipe would wait for a reader, and a slow reader would block the sender.
            msg = f"{settings.file}: is a pipe; choose a regular file or a new file name"
            raise ConfigurationError(msg)
        try:
            # Unbuffered: a block that cannot be written is counted as lost.
            self._file: BinaryIO = settings.file.open("ab", buffering=0)
        except OSError as error:
            msg = f"{settings.file}: cannot write: {error.strerror or error}"
            raise ConfigurationError(msg) from error

    def send(self, blocks: Sequence[bytes]) -> int:
        """Write blocks; on a full disk they are dropped, and no partial block remains."""
        if not blocks:
            return 0
        whole = b"".join(blocks)
        with contextlib.suppress(OSError):
            end = self._file.seek(0, 2)
            with contextlib.suppress(OSError):
                if self._file.write(whole) == len(whole):
                    return len(blocks)
            self._file.truncate(end)
        return 0

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def open_sink(settings: AsterixOutputSettings) -> Sink:
    """Return the destination of a user's blocks.

    Raises
    ------
    ConfigurationError
        If it cannot be opened.
    """
    return FileSink(settings) if settings.port is None else DatagramSink(settings)
