"""Where blocks go: datagrams to a machine or a group, or a file."""

import contextlib
from collections.abc import Sequence
from typing import BinaryIO, Protocol

from multiradar.errors import ConfigurationError
from multiradar.ingest.udp import open_sending
from multiradar.settings.asterix_output import AsterixOutputSettings


class Sink(Protocol):
    """Takes blocks and never waits for who reads them."""

    def send(self, blocks: Sequence[bytes]) -> int:
        """Send blocks; return how many of them went out."""
        ...

    def close(self) -> None:
        """Let go of what is open."""
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
        Address, port, interface and reach.

    Raises
    ------
    ConfigurationError
        If there is no such interface.
    """

    def __init__(self, settings: AsterixOutputSettings) -> None:
        assert settings.port is not None
        self._place = settings.address, settings.port
        try:
            self._socket = open_sending(
                settings.address,
                settings.interface,
                ttl=settings.ttl,
                buffer_octets=settings.send_buffer_octets,
            )
        except OSError as error:
            msg = (
                f"ASTERIX output {settings.label}: cannot send by {settings.interface}, "
                f"{error.strerror or error}"
            )
            raise ConfigurationError(msg) from error
        self._socket.setblocking(False)

    def send(self, blocks: Sequence[bytes]) -> int:
        """Send blocks; those for which there is no room, or no way, are dropped."""
        sent = 0
        for block in blocks:
            with contextlib.suppress(OSError):
                self._socket.sendto(block, self._place)
                sent += 1
        return sent

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class FileSink:
    """Adds blocks to a file, one after another.

    Parameters
    ----------
    settings : AsterixOutputSettings
        The file; what is in it stays.

    Raises
    ------
    ConfigurationError
        If it cannot be written to.
    """

    def __init__(self, settings: AsterixOutputSettings) -> None:
        assert settings.file is not None
        if settings.file.is_fifo():
            # To open it would wait for a reader, and who stops reading would be waited for.
            msg = f"{settings.file}: expected a file or nothing there, was a pipe"
            raise ConfigurationError(msg)
        try:
            # Unbuffered: what one call cannot write is counted where it is lost.
            self._file: BinaryIO = settings.file.open("ab", buffering=0)
        except OSError as error:
            msg = f"{settings.file}: cannot write there, {error.strerror or error}"
            raise ConfigurationError(msg) from error

    def send(self, blocks: Sequence[bytes]) -> int:
        """Write blocks; with a full disk they are dropped, and none is left in part."""
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
    """Return where a user's blocks go.

    Raises
    ------
    ConfigurationError
        If that cannot be opened.
    """
    return FileSink(settings) if settings.port is None else DatagramSink(settings)
