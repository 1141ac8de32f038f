"""Who may connect to a view. Each test tries to break one rule of the server."""

from __future__ import annotations

import os
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest
import viser
from view_clients import PROTOCOL, open_socket, port_of, receive_until_silent, wait_until
from websockets.exceptions import ConnectionClosed, InvalidStatus

from frobs_core.util.errors import ParameterValueError, RunError
from frobs_view import ViewServer
from frobs_view.gate import MAX_CLIENTS, MAX_MESSAGE


@pytest.fixture
def server() -> Iterator[ViewServer]:
    with closing(ViewServer()) as made:
        yield made


def status_of(server: ViewServer, path: str = "/", host: str | None = None) -> int:
    """Return the status of a request for the page."""
    request = urllib.request.Request(f"http://127.0.0.1:{port_of(server)}{path}")
    if host is not None:
        request.add_unredirected_header("Host", host)
    try:
        with urllib.request.urlopen(request, timeout=5) as response:
            return int(response.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_the_page_and_its_connection_are_served(server: ViewServer) -> None:
    assert status_of(server) == 200
    with open_socket(server) as client:
        assert client.subprotocol == PROTOCOL
        assert len(client.recv(timeout=5)) > 100


def test_nothing_listens_beyond_this_machine(server: ViewServer) -> None:
    """Compare all listening sockets of this process with the loopback addresses."""
    listening = own_sockets()
    assert len(listening) >= 2  # the gate and viser
    assert [address for address in listening if not address.startswith("127.")] == []


def test_pages_cannot_find_the_server_behind_the_gate(server: ViewServer) -> None:
    """A page can try all ports of the usual loopback address, but not all loopback addresses."""
    behind = server._viser.get_port()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", behind), timeout=2)
    first, second = server._viser._websock_server._host, None
    with closing(ViewServer()) as other:
        second = other._viser._websock_server._host
    assert first != second


def own_sockets() -> list[str]:
    """Return the addresses at which this process listens."""
    mine = set()
    for link in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):  # the file of this listing
            mine.add(os.readlink(link))
    found = []
    for name in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in mine:
                raw = bytes.fromhex(fields[1].partition(":")[0])
                found.append(socket.inet_ntoa(raw[::-1]) if len(raw) == 4 else raw.hex())
    return found


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "localhost:1", "localhost:8080.evil.example"])
def test_a_foreign_host_is_rejected(server: ViewServer, host: str) -> None:
    assert status_of(server, host=host) == 403


@pytest.mark.parametrize("origin", [None, "null", "http://evil.example", "https://localhost", "http://127.0.0.1:1"])
def test_a_foreign_origin_is_rejected(server: ViewServer, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as caught:
        open_socket(server, origin=origin)
    assert caught.value.response.status_code == 403


def test_other_paths_do_not_exist(server: ViewServer) -> None:
    assert status_of(server, "/../../etc/passwd") == 404
    assert status_of(server, "/index.html") == 404


def test_large_messages_end_the_connection(server: ViewServer) -> None:
    with open_socket(server) as client:
        client.recv(timeout=5)
        client.send(bytes(MAX_MESSAGE + 1))
        with pytest.raises(ConnectionClosed) as caught:
            receive_until_silent(client)
    assert caught.value.rcvd is not None
    assert caught.value.rcvd.code == 1009  # message too big
    assert status_of(server) == 200


def test_the_ninth_client_is_rejected_and_a_place_becomes_free(server: ViewServer) -> None:
    clients = [open_socket(server) for _ in range(MAX_CLIENTS)]
    for client in clients:
        client.recv(timeout=5)
    with pytest.raises(InvalidStatus) as caught:
        open_socket(server)
    assert caught.value.response.status_code == 503
    clients.pop().close()
    wait_until(lambda: len(server._gate._active) < MAX_CLIENTS)
    clients.append(open_socket(server))
    for client in clients:
        client.close()


def test_no_client_can_ask_for_a_public_tunnel(server: ViewServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Send viser's message, and record each connection of this process to another address."""
    outgoing: list[Any] = []
    real = socket.socket.connect

    def recorded(self: socket.socket, address: Any) -> None:
        if isinstance(address, tuple) and not str(address[0]).startswith("127."):
            outgoing.append(address)
            raise OSError("no connection in this test")
        real(self, address)

    monkeypatch.setattr(socket.socket, "connect", recorded)
    asked: list[str] = []
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda self, verbose=True: asked.append("original"))
    received: list[Any] = []
    server._viser._websock_server.register_handler(
        viser._messages.ShareUrlRequest, lambda client, message: received.append(message)
    )
    with open_socket(server) as client:
        client.recv(timeout=5)
        client.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        wait_until(lambda: received)
        receive_until_silent(client)
    assert (outgoing, asked) == ([], [])
    assert server._viser._share_tunnel is None


STRANGE: list[Any] = [
    *({"type": "Nothing"}, {"type": "GuiUpdateMessage"}, {"type": "GuiUpdateMessage", "uuid": 7, "updates": [1]}),
    *({"type": "GuiUpdateMessage", "uuid": "x", "updates": {"value": 1}}, ["type"], {"type": "ViewerCameraMessage"}),
    {"type": "TransformControlsUpdateMessage", "name": "/nothing", "wxyz": "x", "position": None},
]


@pytest.mark.parametrize("message", [b"", b"\xc1", b"\x80", "text", *map(msgspec.msgpack.encode, STRANGE)])
def test_malformed_messages_do_not_disturb_other_clients(
    server: ViewServer, message: Any, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    with open_socket(server) as good:
        good.recv(timeout=5)
        with open_socket(server) as bad:
            bad.recv(timeout=5)
            bad.send(message)
            with suppress(ConnectionClosed):
                receive_until_silent(bad)
        server.gui.add_markdown("still here")
        assert good.recv(timeout=5)
    assert (caplog.messages, *capfd.readouterr()) == ([], "", "")  # a client cannot fill the terminal


@pytest.mark.parametrize("path", ["/", "/wrong/", "/{token}x/", "//{token}/"])
def test_with_a_host_the_token_is_checked_before_the_connection_is_accepted(path: str) -> None:
    with closing(ViewServer(host="127.0.0.1", port=0)) as server:
        token = server.address.rstrip("/").rpartition("/")[2]
        assert len(token) >= 32
        path = path.format(token=token)
        assert status_of(server, path) == 403
        origin = server.address.rpartition(f"/{token}")[0]
        with pytest.raises(InvalidStatus) as caught:
            open_socket(server, origin=origin, path=path.rstrip("/") or "/")
        assert caught.value.response.status_code == 403
        assert status_of(server, f"/{token}/") == 200
        with open_socket(server, origin=origin) as client:
            assert client.recv(timeout=5)


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_all_addresses_at_once_are_rejected(host: str) -> None:
    with pytest.raises(ParameterValueError, match="one address or name of this machine"):
        ViewServer(host=host)


def test_an_address_of_another_machine_is_one_clear_error() -> None:
    with pytest.raises(RunError, match=r"cannot listen at 192\.0\.2\.1.*choose another host or port"):
        ViewServer(host="192.0.2.1")


@pytest.mark.parametrize("address", [{"host": "robot..lab"}, {"host": "a" * 64}, {"port": 70_000}])
def test_an_impossible_address_is_one_clear_error(address: dict[str, Any]) -> None:
    with pytest.raises(RunError, match=r"cannot listen at .*choose another host or port"):
        ViewServer(**address)


def test_a_port_in_use_is_an_error_only_if_it_was_asked_for(server: ViewServer) -> None:
    with pytest.raises(RunError, match="in use"):
        ViewServer(port=port_of(server))
    with closing(ViewServer()) as other:
        assert port_of(other) != port_of(server)


def test_nothing_is_printed_and_closing_twice_is_harmless(capfd: pytest.CaptureFixture[str]) -> None:
    server = ViewServer()
    server.close()
    server.close()
    assert capfd.readouterr() == ("", "")
    with pytest.raises(OSError, match=r"refused|closed"):
        open_socket(server)
