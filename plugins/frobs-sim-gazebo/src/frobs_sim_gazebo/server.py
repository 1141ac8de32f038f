"""A gzserver process that is controlled through a private socket."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import signal
import socket
import subprocess
import tempfile
import time
import weakref
from collections import deque
from textwrap import indent
from typing import IO, NoReturn

from frobs_core.util.errors import SimulationError
from frobs_sim_gazebo.build import built_plugin
from frobs_sim_gazebo.installation import NETWORK_VARIABLE, Installation, find_gazebo
from frobs_sim_gazebo.launch import NO_NAMESPACE
from frobs_sim_gazebo.options import world_text
from frobs_sim_gazebo.protocol import HEADER, Op

TIMEOUT_VARIABLE = "FROBS_GAZEBO_TIMEOUT"
_START = 60.0  # [s] maximum time for a server to become ready
_ANSWER = 60.0  # [s] maximum time to answer a request
_STEP = 0.05  # [s] additional time per physics step
_LOG_LINES = 12
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


class ServerError(SimulationError):
    """Raised when a gzserver exits or does not respond. The message contains the last output of the stopped server."""


class Server:
    """A gzserver process that runs the world plugin.

    Args:
        installation: Gazebo installation, or None to use the result of :func:`find_gazebo`.
        world: Text of the world file, or None for an empty world with FRobs's default physics settings.

    Attributes:
        installation: Gazebo installation.
        process: The server's process. The server does not start child processes.

    Raises:
        SimulationError: Gazebo is not installed, or the plugin cannot be built.
        ServerError: The server does not start.
    """

    def __init__(self, installation: Installation | None = None, world: bytes | None = None) -> None:
        self.installation = installation or find_gazebo()
        folder = self.installation.inside(built_plugin(self.installation))
        text = world or world_text()
        world_name = f"frobs-{hashlib.sha256(text).hexdigest()[:16]}.world"
        file = self.installation.add_file(world_name, lambda aside: aside.write_bytes(text))
        self._timeout = float(os.environ.get(TIMEOUT_VARIABLE) or _ANSWER)
        self._waiting_for: deque[str] = deque()
        self._log: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - the file is open while the server runs
        self._socket, theirs = socket.socketpair()
        theirs.setblocking(True)  # needed because rospy sets a default timeout for all new sockets
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
                start_new_session=True,  # Ctrl-C is handled by this process
            )
        except BaseException:
            self._socket.close()
            self._log.close()
            raise
        finally:
            theirs.close()  # closed in this process, so that reading from the socket ends when the server exits
        self._finalizer = weakref.finalize(self, _end, self.process, self._socket, self._log)
        self._socket.settimeout(_START)
        self.send(Op.HELLO)
        self.version = self.receive(_START).decode()

    def _master(self) -> dict[str, str]:
        """Return environment variables that select a free port for the server's Gazebo master on the host network."""
        if os.environ.get(NETWORK_VARIABLE) != "host":
            return {}
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            return {"GAZEBO_MASTER_URI": f"http://127.0.0.1:{probe.getsockname()[1]}"}

    @property
    def is_alive(self) -> bool:
        """Whether the connection is open."""
        return self._finalizer.alive

    def call(self, op: Op, body: bytes = b"") -> bytes:
        """Send a request, and return the answer. See :meth:`receive`."""
        self.send(op, body)
        return self.receive()

    def send(self, op: Op, body: bytes = b"") -> None:
        """Send a request. The answer must then be read with :meth:`receive`.

        Raises:
            ServerError: The server has exited.
        """
        self._waiting_for.append(op.name.lower())
        try:
            self._socket.sendall(HEADER.pack(len(body), op) + body)
        except OSError:
            self._fail("ended")

    def receive(self, longest: float | None = None, steps: int = 0) -> bytes:
        """Return the answer to the oldest unanswered request.

        Args:
            longest: Time limit [s], or None for the default time limit.
            steps: Number of physics steps in the request. Each physics step extends the time limit.

        Raises:
            ServerError: The server exited, or did not respond in time and was stopped.
            SimulationError: The server rejected the request. The error message contains the reason.
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
            raise SimulationError(f"Gazebo rejected '{asked}': {body.decode(errors='replace')}.")
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
        """Stop the server and raise an error that describes its failure."""
        if how == "ended":
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(5.0)
            code = self.process.poll()
            if code == NO_NAMESPACE:
                how = (
                    "could not create the network namespace that blocks access from other machines. Run as "
                    f"root, allow user namespaces, or set {NETWORK_VARIABLE}=host to let the server listen on this "
                    "machine's network"
                )
            elif code is not None and code < 0:
                how = f"was killed by {signal.Signals(-code).name}"
            elif code is not None:
                how = f"ended with exit code {code}"
        said = self.log()
        self.close()
        during = f" during {self._waiting_for[0]}" if self._waiting_for else ""
        raise ServerError(f"gzserver {how}{during}." + (f" Its last output:\n{indent(said, '  ')}" if said else ""))

    def log(self) -> str:
        """Return the last lines of the server's output."""
        with contextlib.suppress(ValueError, OSError):
            size = self._log.seek(0, os.SEEK_END)
            self._log.seek(max(0, size - 8192))
            said = _COLOUR.sub("", self._log.read().decode(errors="replace"))
            return "\n".join([line for line in said.splitlines() if line.strip()][-_LOG_LINES:])
        return ""

    def close(self) -> None:
        """Stop the server. Repeated calls have no effect."""
        self._finalizer()


def _end(process: subprocess.Popen[bytes], connection: socket.socket, log: IO[bytes]) -> None:
    connection.close()  # the plugin shuts down the server when the connection closes
    deadline = time.monotonic() + 0.5
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    log.close()
