"""Starts programs quickly: forks them from a process that has imported PyTorch and other large libraries.

Importing these libraries takes three seconds, and some tests start a hundred programs. A started program imports FRobs and
plugins itself, so it sees what is installed at that time. Only libraries of other authors are shared.

    python fork_server.py SOCKET
"""

from __future__ import annotations

import array
import atexit
import contextlib
import gc
import importlib
import json
import os
import runpy
import signal
import site
import socket
import subprocess
import sys
import sysconfig
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

LIBRARIES = (
    "gymnasium",
    "matplotlib.figure",
    "mujoco",
    "stable_baselines3",
    "torch._dynamo",  # imported when the first optimizer is made
    "torch.utils.tensorboard",
)

CLIENT = """\
#!{python} -IS
import array, json, os, socket, sys
with socket.socket(socket.AF_UNIX) as server:
    server.connect({socket!r})
    order = json.dumps([{module!r}, sys.argv, os.getcwd(), dict(os.environ)]).encode()
    streams = array.array("i", [0, 1, 2])
    server.sendmsg([len(order).to_bytes(4, "little")], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, streams)])
    server.sendall(order)
    code = server.recv(1)
sys.exit(code[0] if code else "the fork server is gone")
"""
"""Text of a program that asks the server to run a module as this program."""


@contextlib.contextmanager
def fork_server(python: Path, folder: Path, **modules: str) -> Iterator[None]:
    """Run a server, and write programs into a folder that run modules in its processes.

    Args:
        python: Interpreter of the server and the programs.
        folder: For the programs.
        **modules: Module by name of the program.
    """
    with tempfile.TemporaryDirectory() as short:  # the path of a socket has at most 107 characters
        path = f"{short}/socket"
        command = [python, __file__, path]
        with subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, start_new_session=True
        ) as server:
            try:
                assert server.stdout is not None
                assert server.stdout.readline() == b"ready\n"
                for name, module in modules.items():
                    (folder / name).write_text(CLIENT.format(python=python, socket=path, module=module))
                    (folder / name).chmod(0o755)
                yield
            finally:
                os.killpg(server.pid, signal.SIGKILL)


def receive(connection: socket.socket) -> tuple[list[Any], array.array[int]]:
    """Return the order of a client, and its standard streams."""
    streams = array.array("i")
    header, ancillary, *_ = connection.recvmsg(4, socket.CMSG_SPACE(3 * streams.itemsize))
    for _, _, data in ancillary:
        streams.frombytes(data)
    order = b""
    while len(order) < int.from_bytes(header, "little"):
        order += connection.recv(65536)
    return json.loads(order), streams


def become(
    module: str, argv: list[str], folder: str, environment: dict[str, str], streams: array.array[int]
) -> NoReturn:
    """Run a module in this process, as its console script would."""
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin, sys.stdout = open(0, closefd=False), open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = argv
    sys.path[0] = str(Path(sys.executable).parent)
    if sys.prefix != sys.base_prefix:
        site.addsitedir(sysconfig.get_path("purelib"))  # for what was installed after the server started
    importlib.invalidate_caches()
    code: object = 0
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as exit:
        code = exit.code
    except BaseException:
        traceback.print_exc()
        code = 1
    if isinstance(code, str):
        sys.stderr.write(f"{code}\n")
        code = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(code or 0))  # at once: an interpreter with these libraries takes a second to end


def serve(listening: socket.socket) -> tuple[list[Any], array.array[int]]:
    """Fork for each connection; return in the process that becomes the program."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    owner = os.getppid()
    listening.settimeout(5.0)
    while os.getppid() == owner:
        try:
            connection, _ = listening.accept()
        except TimeoutError:
            continue
        if os.fork():
            connection.close()
            continue
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        listening.close()
        order, streams = receive(connection)
        pid = os.fork()
        if not pid:
            connection.close()
            return order, streams
        _, status = os.waitpid(pid, 0)
        with contextlib.suppress(BrokenPipeError):
            code = os.waitstatus_to_exitcode(status)
            connection.sendall(bytes([code if code >= 0 else 128 - code]))  # as a shell tells of a signal
        os._exit(0)
    sys.exit("the owner of this fork server has ended")


def main() -> None:
    """Import the libraries that are installed, and run the server."""
    for library in LIBRARIES:
        with contextlib.suppress(ModuleNotFoundError):
            importlib.import_module(library)
    gc.collect()
    gc.freeze()  # so that the collections of a program do not touch, and so copy, the memory of the libraries
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(sys.argv[1])
        listening.listen()
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        (module, argv, folder, environment), streams = serve(listening)
    become(module, argv, folder, environment, streams)


if __name__ == "__main__":
    main()
