"""The proxy in front of the web server, which checks every connection before a byte of it reaches the server.

The server itself has no check of the origin and no token. It therefore listens on a random loopback address that no page
can guess, and only the proxy connects to it.
"""

from __future__ import annotations

import asyncio
import errno
import hmac
import logging
import threading
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

from websockets.asyncio.client import connect
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.http11 import Request, Response

from frobs_core.util.errors import RunError
from frobs_core.util.plain import to_json
from frobs_view.devices import Devices

MAX_MESSAGE = 1_000_000
"""Maximum size of a message from a client [bytes]."""

MAX_CLIENTS = 8
"""Maximum number of clients at the same time."""

PORTS = 20
"""Number of consecutive ports that are tried."""

INPUT = "input"
"""Last part of the path at which pages send keys and gamepads."""

_PROTOCOL = "viser-v"
_SECURITY = {
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Gate:
    """Accepts connections at one address, and passes permitted connections on to the server.

    Args:
        host: Address of this machine at which to listen.
        port: First port to try.
        names: Values of the ``Host`` header, without the port, that name this server.
        token: Text that the path of each request must begin with, or an empty string.
        page: The page, as bytes of HTML.
        upstream: Address of the server, such as ``"ws://127.3.4.5:6789"``.
        devices: Keys and gamepads, which receive the messages of the pages.
        exactly: Whether to try only ``port``, instead of the ports after it, too.

    Attributes:
        port: The port.

    Raises:
        RunError: The address does not exist on this machine, or all ports are in use.
    """

    def __init__(
        self,
        host: str,
        port: int,
        names: tuple[str, ...],
        token: str,
        page: bytes,
        upstream: str,
        devices: Devices,
        *,
        exactly: bool = False,
    ) -> None:
        self._host, self._names, self._token = host, names, token
        self._page, self._upstream, self._devices = page, upstream, devices
        self._active: set[ServerConnection] = set()
        self._inputs: set[ServerConnection] = set()
        self._ready: Future[int] = Future()
        ports = [port] if exactly else list(range(port, port + PORTS))
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run(ports)), name="frobs-view", daemon=True)
        self._thread.start()
        self.port = self._ready.result()

    def close(self) -> None:
        """Close all connections and stop. Repeated calls have no effect."""
        with suppress(RuntimeError):  # the event loop is closed already
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(timeout=5.0)

    @property
    def is_used(self) -> bool:
        """Whether a client is connected."""
        return bool(self._active)

    async def _run(self, ports: list[int]) -> None:
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        for port in ports:
            try:
                server = await self._listen(port)
            except (OSError, UnicodeError, OverflowError) as error:  # the latter two for impossible names and ports
                if getattr(error, "errno", None) == errno.EADDRINUSE and port != ports[-1]:
                    continue
                reason = getattr(error, "strerror", None) or str(error)
                text = f"cannot listen at {self._host}, port {port}: {reason}; choose another host or port."
                self._ready.set_exception(RunError(text))
                return
            async with server:
                self._ready.set_result(next(iter(server.sockets)).getsockname()[1])
                await self._stop.wait()
            return

    async def _listen(self, port: int) -> Server:
        return await serve(
            self._serve,
            self._host,
            port,
            process_request=self._check,
            max_size=MAX_MESSAGE,
            compression=None,
            select_subprotocol=lambda _, offered: next((p for p in offered if p.startswith(_PROTOCOL)), None),
            logger=_quiet(),
            server_header=None,
            close_timeout=1,
        )

    def _check(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a request that opens no WebSocket, or None to accept a WebSocket."""
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or hosts[0] not in self._addresses():
            return _answer(403, "The Host header does not name this server.")
        path = request.path.partition("?")[0]
        if self._token:
            given, _, path = path.removeprefix("/").partition("/")
            if not hmac.compare_digest(given.encode(), self._token.encode()):
                return _answer(403, "Open the complete address that was printed, including its token.")
        if "websocket" not in (request.headers.get("Upgrade") or "").lower():
            return self._answer_page(hosts[0]) if path in ("", "/") else _answer(404, "Not found.")
        if request.headers.get_all("Origin") != [f"http://{hosts[0]}"]:
            return _answer(403, "The Origin header does not name this server.")
        if len(self._inputs if _is_input(request) else self._active) >= MAX_CLIENTS:
            return _answer(503, f"At most {MAX_CLIENTS} clients can be connected.")
        return None

    def _addresses(self) -> list[str]:
        port = self._ready.result()
        return [f"{name}:{port}" for name in self._names] + (list(self._names) if port == 80 else [])

    def _answer_page(self, host: str) -> Response:
        # The page must not connect to other servers, even if its address asks it to.
        policy = f"connect-src ws://{host} data: blob:; frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
        headers = {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": policy}
        return _answer(200, self._page, headers)

    async def _serve(self, client: ServerConnection) -> None:
        if client.request is not None and _is_input(client.request):
            await self._receive_input(client)
            return
        if len(self._active) >= MAX_CLIENTS or client.subprotocol is None:
            await client.close(1013, "Too many clients, or a page of another version.")
            return
        self._active.add(client)
        try:
            async with connect(
                self._upstream,
                subprotocols=[client.subprotocol],
                compression=None,
                max_size=None,
                proxy=None,
                ping_interval=None,
                close_timeout=1,
                logger=_quiet(),
            ) as server:
                tasks = [asyncio.create_task(_pass_on(client, server)), asyncio.create_task(_pass_on(server, client))]
                await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
        except (OSError, WebSocketException):
            await client.close(1011, "The view has ended.")
        finally:
            self._active.discard(client)

    async def _receive_input(self, page: ServerConnection) -> None:
        """Store the keys and the gamepad of a page until it is closed, and tell it which keys are wanted."""
        if len(self._inputs) >= MAX_CLIENTS:
            await page.close(1013, "Too many clients.")
            return
        self._inputs.add(page)
        sent: frozenset[str] = frozenset()
        try:
            async for message in page:
                if not self._devices.receive(page, message):
                    await page.close(1008, "Not the state of keys and a gamepad.")
                    return
                if self._devices.wanted != sent:
                    sent = self._devices.wanted
                    await page.send(to_json(sorted(sent)))
        except ConnectionClosed:
            return
        finally:
            self._inputs.discard(page)
            self._devices.release(page)


def _is_input(request: Request) -> bool:
    return request.path.partition("?")[0].rpartition("/")[2] == INPUT


async def _pass_on(source: Any, target: Any) -> None:
    """Send each message of one connection to the other, until one of them is closed."""
    with suppress(ConnectionClosed):
        async for message in source:
            if isinstance(message, bytes):  # the server understands only binary messages
                await target.send(message)


def _answer(status: int, body: str | bytes, headers: dict[str, str] | None = None) -> Response:
    data = body.encode() if isinstance(body, str) else body
    lines = {"Content-Type": "text/plain; charset=utf-8", **_SECURITY, **(headers or {})}
    lines |= {"Content-Length": str(len(data)), "Connection": "close"}
    return Response(status, "OK" if status == 200 else "Refused", Headers(**lines), data)


def _quiet() -> logging.Logger:
    """Return a logger that prints nothing, because strangers must not be able to fill the terminal."""
    logger = logging.getLogger("frobs.view.websockets")
    logger.setLevel(logging.CRITICAL)
    return logger
