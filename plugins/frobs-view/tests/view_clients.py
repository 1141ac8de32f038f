"""Clients that connect to a view like its page does, and what they receive."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import ClientConnection, connect

from frobs_view import ViewServer

PROTOCOL = f"viser-v{viser.__version__}"


def port_of(server: ViewServer) -> int:
    return int(server.address.split(":")[2].partition("/")[0])


def open_socket(
    server: ViewServer, *, origin: str | None = "", host: str = "", protocol: str = PROTOCOL, path: str | None = None
) -> ClientConnection:
    """Connect as the page does, or with other headers."""
    address = server.address.rstrip("/")
    name = address.removeprefix("http://").partition("/")[0]
    uri = address.replace("http://", "ws://") if path is None else f"ws://{name}{path}"
    headers = {"Host": host} if host else {}
    chosen: Any = f"http://{name}" if origin == "" else origin
    return connect(
        uri,
        origin=chosen,
        additional_headers=headers,
        subprotocols=[protocol],  # type: ignore[list-item]
        max_size=None,
        proxy=None,
    )


def receive_until_silent(client: Any) -> None:
    """Receive messages until there are none for a second."""
    with suppress(TimeoutError):
        while True:
            client.recv(timeout=1.0)


def wait_until(condition: Any, seconds: float = 10.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def messages(data: Any) -> list[dict[str, Any]]:
    """Return the messages of a window that the server sent."""
    size = int.from_bytes(data[8:16], "little")
    inner = zstandard.ZstdDecompressor().decompress(
        data[16 : 16 + size], max_output_size=int.from_bytes(data[:8], "little")
    )
    return list(msgspec.msgpack.decode(inner)["messages"])


def receive(client: Any, seconds: float) -> list[dict[str, Any]]:
    """Return all messages that arrive within some seconds."""
    found: list[dict[str, Any]] = []
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        try:
            found += messages(client.recv(timeout=left))
        except TimeoutError:
            break
    return found


def moves(received: list[dict[str, Any]]) -> int:
    """Return how many positions of frames are among messages."""
    return sum(one["type"] == "SetPositionMessage" and "/frame" in one["name"] for one in received)


def encode(message: Any) -> bytes:
    """Return a message as a page sends it."""
    return msgspec.msgpack.encode(message.as_serializable_dict([]))
