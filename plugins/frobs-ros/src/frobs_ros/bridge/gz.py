"""The ``gz`` command, limited to the subcommands that FRobs_RL and similar packages use.

``gz world -m N`` makes N physics steps, ``-s`` makes one step, ``-p 1|0`` pauses or unpauses, ``-r`` resets the time
and all models, and ``-o`` resets only the models. The command returns after the bridge has executed the request. If no
bridge responds, the next ``gz`` on ``PATH``, which is usually Gazebo's own command, runs instead. The command calls
the bridge without rospy, because importing rospy would account for most of the command's run time.
"""

from __future__ import annotations

import argparse
import os
import shutil
import socket
import struct
import sys
import xmlrpc.client
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

_EMPTY = "d41d8cd98f00b204e9800998ecf8427e"  # std_srvs/Empty
_STEP = "2706712db112a49a54209066e2436172"  # frobs_msgs/StepWorld
_CALLER = "/gz"


class GzError(Exception):
    """Raised if the bridge does not respond or rejects a call."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        The exit code.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    address = _find("/gazebo/step")
    if address is None:
        other = _next_gz()
        if other is not None:
            os.execv(other, [other, *given])
        master = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
        return _fail(f"no FRobs bridge is connected to the ROS master {master}; start a bridge with 'frobs ros serve'.")
    options = _parse(given)
    try:
        if options.pause is not None:
            _call("/gazebo/pause_physics" if options.pause else "/gazebo/unpause_physics", _EMPTY, b"")
        for requested, service in ((options.reset_all, "reset_simulation"), (options.reset_models, "reset_world")):
            if requested:
                _call(f"/gazebo/{service}", _EMPTY, b"")
        steps = options.multi_step or int(options.step)
        if steps:
            reply = _call("/gazebo/step", _STEP, struct.pack("<I", steps))
            success, length = struct.unpack_from("<?I", reply, 8)
            if not success:
                raise GzError(reply[13 : 13 + length].decode(errors="replace"))
    except (GzError, OSError, struct.error) as error:
        return _fail(str(error))
    return 0


def _parse(given: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gz", description="Run commands of Gazebo's gz program on the FRobs bridge.")
    world = parser.add_subparsers(dest="command", required=True).add_parser(
        "world", help="pause, step or reset the simulation"
    )
    world.add_argument("-w", "--world-name", help="ignored, because the bridge has only one world")
    world.add_argument("-p", "--pause", type=int, choices=(0, 1), help="1: pause; 0: unpause")
    world.add_argument("-s", "--step", action="store_true", help="run one physics step")
    world.add_argument(
        "-m", "--multi-step", type=_steps, metavar="N", help="run N physics steps and wait until they are complete"
    )
    world.add_argument("-r", "--reset-all", action="store_true", help="reset all models, and set the time to 0")
    world.add_argument("-o", "--reset-models", action="store_true", help="reset all models")
    return parser.parse_args(given)


def _steps(text: str) -> int:
    number = int(text)
    if not 0 < number < 2**32:
        raise ValueError
    return number


def _find(service: str) -> tuple[str, int] | None:
    """Return the host and port of a service, or None if the service is unavailable."""
    uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
    try:
        answer: Any = xmlrpc.client.ServerProxy(uri).lookupService(_CALLER, service)
    except (OSError, xmlrpc.client.Error):
        return None
    code, _, found = answer
    address = urlparse(str(found))
    return (address.hostname, address.port) if code == 1 and address.hostname and address.port else None


def _call(service: str, checksum: str, request: bytes) -> bytes:
    """Call a service of the bridge and return the serialized response."""
    address = _find(service)
    if address is None:
        raise GzError(f"there is no service {service}.")
    fields = (f"callerid={_CALLER}", f"md5sum={checksum}", f"service={service}")
    header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
    with socket.create_connection(address, timeout=10.0) as connection:
        connection.sendall(struct.pack("<I", len(header)) + header)
        _receive(connection)
        connection.settimeout(None)  # no time limit, because many steps can take a long time
        connection.sendall(struct.pack("<I", len(request)) + request)
        good = _exactly(connection, 1) == b"\x01"
        answer = _receive(connection)
    if not good:
        raise GzError(answer.decode(errors="replace"))
    return answer


def _receive(connection: socket.socket) -> bytes:
    return _exactly(connection, struct.unpack("<I", _exactly(connection, 4))[0])


def _exactly(connection: socket.socket, size: int) -> bytes:
    received = b""
    while len(received) < size:
        component = connection.recv(size - len(received))
        if not component:
            raise GzError("the bridge closed the connection.")
        received += component
    return received


def _next_gz() -> str | None:
    """Return the first ``gz`` on ``PATH`` that is not this command, or None."""
    own = Path(sys.argv[0]).resolve().parent
    folders = [folder for folder in os.environ.get("PATH", "").split(os.pathsep) if folder]
    return shutil.which("gz", path=os.pathsep.join(folder for folder in folders if Path(folder).resolve() != own))


def _fail(text: str) -> int:
    sys.stderr.write(f"gz: {text}\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
