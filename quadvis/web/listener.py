"""The port: who may connect, how many at once, and the files of the page as answers to plain requests."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

from quadvis.errors import QuadvisError
from quadvis.web.access import HEADERS, LOOPBACK, Access, policy
from quadvis.web.files import page_files
from quadvis.web.messages import MOST_TEXT

if TYPE_CHECKING:
    from websockets.asyncio.server import Server

LIVE = "/live"  # the path of the socket
CONNECTIONS = 48  # TCP connections, those included that have said nothing yet
OPENING = 5.0  # s until a connection has said what it wants
BUFFER = 64_000  # bytes that the system keeps for a page: more would be old when they arrive


class Listener:
    """Serves files, and hands sockets of pages to ``talk`` as long as ``room`` says that there is room."""

    def __init__(self, talk: Callable[[Any], Awaitable[None]], room: Callable[[], bool]) -> None:
        self._talk, self._room = talk, room
        self._files = page_files()
        self._connections = 0
        self.port = 0
        self.access: Access

    async def open(self, port: int, announce: Callable[[str], None]) -> Server:
        """Open a port of the loopback interface, 0 for any free one; QuadvisError if it is taken."""
        from websockets.asyncio.server import serve

        silent = logging.getLogger("quadvis.web")  # whoever breaks the protocol is no failure of ours
        silent.addHandler(logging.NullHandler())
        silent.propagate = False
        try:
            server = await serve(
                self._talk, LOOPBACK, port, process_request=self._answer, create_connection=self._counted(),
                compression=None, max_size=MOST_TEXT, max_queue=8, write_limit=BUFFER, ping_interval=None,
                open_timeout=OPENING, close_timeout=1, server_header=None, logger=silent, start_serving=False,
            )  # fmt: skip
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise QuadvisError(
                f"port {port} cannot be opened ({why}); name another one with --port"
            ) from None
        self.port = next(iter(server.sockets)).getsockname()[1]
        self.access = Access(self.port, announce)
        await server.start_serving()
        return server

    def _counted(self) -> Any:
        """Return the class of a connection that counts itself, and is cut if there are too many."""
        from websockets.asyncio.server import ServerConnection

        listener = self

        class Counted(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                listener._connections += 1
                super().connection_made(transport)
                plain = transport.get_extra_info("socket")
                plain.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)
                if listener._connections > CONNECTIONS:
                    listener.access.refuse("more connections than are possible")
                    transport.abort()  # type: ignore[attr-defined]

            def connection_lost(self, exc: Exception | None) -> None:
                listener._connections -= 1
                super().connection_lost(exc)

        return Counted

    def _answer(self, connection: Any, request: Any) -> Any:
        """Answer a plain request; None lets a page have its socket."""
        given: dict[str, list[str]] = {}
        for name, value in request.headers.raw_items():
            given.setdefault(name.lower(), []).append(value)
        live = request.path == LIVE
        if objection := self.access.objection(given, live):
            return _response(connection, 403, f"{objection}\n".encode())
        if live:
            return None if self._room() else _response(connection, 503, b"too many pages are open\n")
        file = self._files.get(request.path.partition("?")[0])
        if file is None:
            return _response(connection, 404, b"there is no such file\n")
        return _response(connection, 200, file.data, file.kind, policy(given["host"][0]))


def _response(
    connection: Any, status: int, body: bytes, kind: str = "text/plain; charset=utf-8", csp: str = ""
) -> Any:
    response = connection.respond(status, "")
    response.body = body
    more = {"Content-Security-Policy": csp or "default-src 'none'", "Content-Type": kind}
    for name, value in {**HEADERS, **more, "Content-Length": str(len(body))}.items():
        if name in response.headers:
            del response.headers[name]
        response.headers[name] = value
    return response
