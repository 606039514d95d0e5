"""How the server is configured, and what it does to each connection."""

import asyncio
import contextlib
import socket
from typing import Any

import pytest
from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.frames import Frame, Opcode
from websockets.protocol import State

from multiradar.api.connections.frames import FRAME, text_frame
from multiradar.api.connections.registry import Registry
from multiradar.api.connections.server import server_config
from multiradar.settings.limits import HttpLimits
from support.processes.waiting import wait_until


@pytest.mark.parametrize(("connections", "waiting"), [(7, 7), (1_000_000, socket.SOMAXCONN)])
async def test_connections_wait_in_the_system_up_to_either_limit(
    application: FastAPI, connections: int, waiting: int
) -> None:
    limits = HttpLimits(connections_max=connections)
    assert server_config(application, "127.0.0.1", 0, limits).backlog == waiting


async def test_answers_do_not_wait_for_the_acknowledgement_of_their_headers(
    application: FastAPI,
) -> None:
    config = server_config(application, "127.0.0.1", 0, HttpLimits())
    config.load()
    made: list[H11Protocol] = []

    def protocol() -> H11Protocol:
        assert issubclass(config.http_protocol_class, H11Protocol)
        made.append(config.http_protocol_class(config, ServerState(), {}))
        return made[0]

    # A listening socket that does not name its protocol, as the service makes it.
    listener = socket.create_server(("127.0.0.1", 0))
    serving = await asyncio.get_running_loop().create_server(protocol, sock=listener)
    async with serving:
        _, writer = await asyncio.open_connection(*listener.getsockname())
        await asyncio.to_thread(
            wait_until, lambda: made and made[0].transport is not None, "the connection"
        )
        accepted = made[0].transport.get_extra_info("socket")
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) != 0
        made[0].transport.abort()
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


async def test_a_stop_closes_the_socket_of_a_client_that_said_goodbye_before(
    application: FastAPI,
) -> None:
    config = server_config(application, "127.0.0.1", 0, HttpLimits())
    config.load()
    assert isinstance(config.ws_protocol_class, type)
    leaving = config.ws_protocol_class(config, ServerState(), {})  # type: ignore[call-arg]
    assert isinstance(leaving, WebSocketsSansIOProtocol)
    ours, theirs = socket.socketpair()
    with theirs:
        loop = asyncio.get_running_loop()
        leaving.transport, _ = await loop.create_connection(asyncio.Protocol, sock=ours)
        leaving.handshake_complete = True
        # Its close frame is here, the end of its connection is not.
        leaving.conn.state = State.CLOSING
        leaving.shutdown()
        assert leaving.transport.is_closing()


class _Failing(asyncio.Transport):
    """A connection whose buffer cannot be read, as that of TLS that has been closed twice."""

    def __init__(self) -> None:
        super().__init__()
        self.asked = 0
        self.asked_again = asyncio.Event()

    def is_closing(self) -> bool:
        return False

    def get_write_buffer_size(self) -> int:
        self.asked += 1
        if self.asked > 1:
            self.asked_again.set()
        raise AttributeError


async def test_the_search_for_clients_that_do_not_read_goes_on_after_an_error() -> None:
    errors: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, error: errors.append(error))
    registry, failing = Registry(HttpLimits(send_deadline_s=0.01)), _Failing()
    assert registry.admit(failing)
    await failing.asked_again.wait()
    registry.lost(failing)
    assert errors


@pytest.mark.parametrize("length", [0, 1, 125, 126, 127, 65_535, 65_536, 70_000])
def test_a_frame_is_that_of_the_library(length: int) -> None:
    text = b"x" * length
    frame = Frame(Opcode.TEXT, text).serialize(mask=False)
    assert text_frame([text[:3], text[3:]]) == frame


async def test_a_frame_is_sent_only_while_the_socket_is_open(application: FastAPI) -> None:
    config = server_config(application, "127.0.0.1", 0, HttpLimits())
    config.load()
    assert isinstance(config.ws_protocol_class, type)
    protocol = config.ws_protocol_class(config, ServerState(), {})  # type: ignore[call-arg]
    assert isinstance(protocol, WebSocketsSansIOProtocol)
    ours, theirs = socket.socketpair()
    with theirs:
        loop = asyncio.get_running_loop()
        protocol.transport, _ = await loop.create_connection(asyncio.Protocol, sock=ours)
        message: Any = {"type": "websocket.send", FRAME: text_frame([b"text"])}
        protocol.conn.state = State.OPEN
        await protocol.send(message)
        assert theirs.recv(100) == b"\x81\x04text"
        protocol.writable.clear()
        waiting = asyncio.create_task(protocol.send(message))
        await asyncio.sleep(0.0)
        assert not waiting.done()
        # The client has said goodbye meanwhile.
        protocol.conn.state = State.CLOSING
        protocol.writable.set()
        with pytest.raises(ClientDisconnected):
            await waiting
        theirs.setblocking(False)
        with pytest.raises(BlockingIOError):
            theirs.recv(100)
        protocol.transport.abort()


def test_the_server_sends_no_server_header_and_ignores_proxy_headers(
    application: FastAPI,
) -> None:
    config = server_config(application, "127.0.0.1", 0, HttpLimits(header_bytes_max=5_000))
    assert not config.server_header
    assert not config.proxy_headers
    assert config.h11_max_incomplete_event_size == 5_000
