"""The web server of a view: viser behind a gate."""

from __future__ import annotations

import ipaddress
import logging
import os
import secrets
import traceback
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import viser

from frobs_core.util.errors import ParameterValueError
from frobs_view.devices import Devices, with_script
from frobs_view.gate import Gate

PORT = 8080
"""First port that is tried."""

_VISER = Path(viser.__file__).parent
_LOOPBACK = ("localhost", "127.0.0.1", "[::1]")


class _Viser(viser.ViserServer):
    """viser without public tunnels, which any client could open otherwise."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Do nothing, instead of opening a public tunnel to this machine."""

    def disconnect_share_url(self) -> None:
        """Do nothing."""


class _OfStrangers(logging.Filter):
    """Rejects the traceback of a message that viser cannot handle. A client could fill the terminal with them."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a record is not the failure of one of viser's connections."""
        trace = record.exc_info[2] if record.exc_info else None
        files = [frame.f_code.co_filename for frame, _ in traceback.walk_tb(trace)]
        return not any(Path(file).is_relative_to(_VISER) for file in files)


_of_strangers = _OfStrangers()


class ViewServer:
    """Serves a page that shows a scene and a panel.

    By default, only programs on this machine can connect. If ``host`` is given, the server listens at that address, and
    only clients with the token in :attr:`address` can connect.

    Args:
        host: Address or name of this machine in the network, or None for this machine only.
        port: Port, or None for the first free port from 8080 on.
        title: Title of the panel.

    Attributes:
        scene: The scene, as an object of viser.
        gui: The panel, as an object of viser.
        devices: Keys and gamepads of the people who look at the page.
        address: Address to open in a browser.

    Raises:
        ParameterValueError: The host is a placeholder for all addresses of this machine.
        RunError: The address does not exist on this machine, or the port is in use.
    """

    def __init__(self, host: str | None = None, port: int | None = None, title: str = "FRobs") -> None:
        token = "" if host is None else secrets.token_urlsafe(24)
        names = _LOOPBACK if host is None else _names(host)
        inner = f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"
        with _silent():
            self._viser = _Viser(host=inner, port=0, label=title, verbose=False)
        logging.getLogger("websockets.server").addFilter(_of_strangers)
        page = _VISER / "client" / "build" / "index.html"
        try:
            upstream = f"ws://{inner}:{self._viser.get_port()}"
            bind = "127.0.0.1" if host is None else host.strip("[]")
            first = PORT if port is None else port
            self.devices, html = Devices(), with_script(page.read_bytes())
            self._gate = Gate(bind, first, names, token, html, upstream, self.devices, exactly=port is not None)
        except BaseException:
            self._stop()
            raise
        self.scene: Any = self._viser.scene
        self.gui: Any = self._viser.gui
        self.gui.configure_theme(show_logo=False, show_share_button=False)
        self.gui.main_panel.dock_right()
        self.scene.configure_default_lights(cast_shadow=False)
        name = "localhost" if host is None else names[0]
        self.address = f"http://{name}:{self._gate.port}/" + (f"{token}/" if token else "")

    @property
    def has_clients(self) -> bool:
        """Whether a page is connected."""
        return self._gate.is_used

    def clients(self) -> dict[int, Any]:
        """Return the clients that have sent their camera pose, as objects of viser by number."""
        return dict(self._viser.get_clients())

    @property
    def initial_camera(self) -> Any:
        """The camera of new clients, as an object of viser."""
        return self._viser.initial_camera

    def together(self) -> AbstractContextManager[None]:
        """Return a context whose changes arrive at the pages together."""
        context: AbstractContextManager[None] = self._viser.atomic()
        return context

    def close(self) -> None:
        """Disconnect all clients and stop. Repeated calls have no effect."""
        self._gate.close()
        self._stop()

    def _stop(self) -> None:
        if not getattr(self, "_stopped", False):
            self._stopped = True
            with _silent():
                self._viser.stop()


def _names(host: str) -> tuple[str, ...]:
    """Return the names of this server in the ``Host`` header of requests."""
    try:
        address = ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        return (host.lower(),)
    if address.is_unspecified:
        rule = "one address or name of this machine, so that pages of other servers can be rejected"
        raise ParameterValueError("host", host, rule)
    return (f"[{address}]" if address.version == 6 else str(address),)


@contextmanager
def _silent() -> Iterator[None]:
    """Discard the lines that viser prints, which name an address that must not be used."""
    with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
        yield
