"""One gzserver, owned: started, spoken to through a socket that only the two processes have, ended by handle."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import tempfile
import time
import weakref
from collections import deque
from typing import IO, NoReturn

from frobs_core.errors import SimulationError
from frobs_sim_gazebo.build import built_plugin, stored_world
from frobs_sim_gazebo.installation import NETWORK_VARIABLE, Installation, find_gazebo
from frobs_sim_gazebo.launch import NO_NAMESPACE
from frobs_sim_gazebo.options import world_text
from frobs_sim_gazebo.protocol import HEADER, Op

TIMEOUT_VARIABLE = "FROBS_GAZEBO_TIMEOUT"
_START = 60.0  # [s] until a server must have said hello
_ANSWER = 60.0  # [s] until it must have answered
_STEP = 0.05  # [s] that a physics step may take on top
_LOG_LINES = 12
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


class ServerError(SimulationError):
    """A gzserver ended, or did not answer; it has been ended and its last words are in the message."""


class Server:
    """A gzserver with the world plugin.

    Args:
        installation: Of Gazebo; None: :func:`find_gazebo` finds it.
        world: Text of the world file; None: the empty world with our settings of the physics engine.

    Attributes:
        installation: Of Gazebo.
        process: The server's; it holds no others.

    Raises:
        SimulationError: Gazebo is not here, or the plugin cannot be built.
        ServerError: It does not start.
    """

    def __init__(self, installation: Installation | None = None, world: bytes | None = None) -> None:
        self.installation = installation or find_gazebo()
        folder = self.installation.inside(built_plugin(self.installation))
        file = self.installation.inside(stored_world(self.installation, world or world_text()))
        self._timeout = float(os.environ.get(TIMEOUT_VARIABLE) or _ANSWER)
        self._waiting_for: deque[str] = deque()
        self._log: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the server
        self._socket, theirs = socket.socketpair()
        theirs.setblocking(True)  # what rospy does not leave it: it gives all of its process's sockets a timeout
        try:
            self.process = subprocess.Popen(
                self.installation.command("gzserver", "--verbose", file),
                env=self.installation.environment(
                    FROBS_GAZEBO_FD=str(theirs.fileno()), GAZEBO_PLUGIN_PATH=folder, **self._master()
                ),
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=subprocess.STDOUT,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,  # Ctrl-C is for the process that holds the other end
            )
        except BaseException:
            self._socket.close()
            self._log.close()
            raise
        finally:
            theirs.close()  # so that reading ends when the server does
        self._finalizer = weakref.finalize(self, _end, self.process, self._socket, self._log)
        self._socket.settimeout(_START)
        self.send(Op.HELLO)
        self.version = self.receive(_START).decode()

    def _master(self) -> dict[str, str]:
        """Return the address of Gazebo's own master; on the host's network each server needs another port."""
        if os.environ.get(NETWORK_VARIABLE) != "host":
            return {}
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            return {"GAZEBO_MASTER_URI": f"http://127.0.0.1:{probe.getsockname()[1]}"}

    @property
    def is_alive(self) -> bool:
        """Whether it can be spoken to."""
        return self._finalizer.alive

    def call(self, op: Op, body: bytes = b"") -> bytes:
        """Send a request and return its answer; see :meth:`receive`."""
        self.send(op, body)
        return self.receive()

    def send(self, op: Op, body: bytes = b"") -> None:
        """Send a request, whose answer :meth:`receive` must fetch.

        Raises:
            ServerError: The server is gone.
        """
        self._waiting_for.append(op.name.lower())
        try:
            self._socket.sendall(HEADER.pack(len(body), op) + body)
        except OSError:
            self._fail("ended")

    def receive(self, longest: float | None = None, steps: int = 0) -> bytes:
        """Return the answer to the oldest request that was sent and not answered yet.

        Args:
            longest: [s] to wait.
            steps: Physics steps that it makes meanwhile.

        Raises:
            ServerError: The server ended, or did not answer in time; it is ended then.
            SimulationError: It refused the request, and says why.
        """
        seconds = (self._timeout if longest is None else longest) + _STEP * steps
        try:
            self._socket.settimeout(seconds)
            size, done = HEADER.unpack(self._read(HEADER.size))
            body = self._read(size)
        except TimeoutError:
            self._fail(f"did not answer for {seconds:.0f} s")
        except OSError:
            self._fail("ended")
        asked = self._waiting_for.popleft()
        if not done:
            raise SimulationError(f"Gazebo refused '{asked}': {body.decode(errors='replace')}.")
        return body

    def _read(self, size: int) -> bytes:
        data = bytearray()
        while len(data) < size:
            part = self._socket.recv(size - len(data))
            if not part:
                raise ConnectionResetError
            data += part
        return bytes(data)

    def _fail(self, how: str) -> NoReturn:
        """End the server and raise the error that says how it failed."""
        if how == "ended":
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(5.0)
            code = self.process.poll()
            if code == NO_NAMESPACE:
                how = (
                    "could not have a network of its own, without which others could reach it. Run as root, allow user "
                    f"namespaces, or say {NETWORK_VARIABLE}=host to let it listen on this machine's network"
                )
            elif code is not None and code < 0:
                how = f"was killed by {signal.Signals(-code).name}"
            elif code is not None:
                how = f"ended with exit code {code}"
        said = self.log()
        self.close()
        during = f" during {self._waiting_for[0]}" if self._waiting_for else ""
        raise ServerError(f"gzserver {how}{during}." + (f" It said last:\n{said}" if said else ""))

    def log(self) -> str:
        """Return the last lines of what the server said."""
        with contextlib.suppress(ValueError, OSError):
            size = self._log.seek(0, os.SEEK_END)
            self._log.seek(max(0, size - 8192))
            said = _COLOUR.sub("", self._log.read().decode(errors="replace"))
            return "\n".join([line for line in said.splitlines() if line.strip()][-_LOG_LINES:])
        return ""

    def close(self) -> None:
        """End the server; twice is harmless."""
        self._finalizer()


def _end(process: subprocess.Popen[bytes], connection: socket.socket, log: IO[bytes]) -> None:
    connection.close()  # at which the plugin ends the server
    deadline = time.monotonic() + 0.5
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    log.close()
