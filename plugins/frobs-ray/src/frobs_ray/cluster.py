"""Connects to a Ray cluster, or starts a cluster on this machine."""

from __future__ import annotations

import logging
import os
import secrets
import signal
import socket
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from importlib import import_module
from typing import Any

import ray
from ray.exceptions import AuthenticationError, RaySystemError, RpcError

from frobs_ray.errors import ClusterConnectionError

LOOPBACK = "127.0.0.1"
OBJECT_STORE = 512 * 2**20
"""Shared memory of a cluster on this machine [bytes]. Ray allocates memory on demand and writes excess data to disk."""

_ALWAYS = {
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # selects Ray's new behavior and avoids a warning from Ray
    "RAY_BACKEND_LOG_LEVEL": "fatal",  # hides warnings that Ray's C++ code prints to stderr
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",  # workers use this Python environment, and the working folder is not copied
}
# Ray listens on all network interfaces, so a token protects a cluster on this machine. This process creates the token,
# because Ray would otherwise write a token to the user's home directory.
_LOCAL = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32), "RAY_USAGE_STATS_ENABLED": "0"}
_BANNER = b"Set ray log level from environment variable"
_TIMEOUT = 10.0  # [s] maximum time for the first connection to a head node


@contextmanager
def connect(address: str | None = None, num_cpus: int | None = None) -> Iterator[None]:
    """Connect this process to a Ray cluster for the duration of the ``with`` block.

    If this process is already connected, the existing connection is used and remains open afterwards. Ray's messages
    are suppressed, and the caller's signal handlers for Ctrl-C and SIGTERM remain in place.

    Args:
        address: ``"host:port"`` of the head node, or ``"auto"`` for the cluster that is running on this machine.
            Defaults to a new cluster on this machine, which is stopped at the end of the block.
        num_cpus: Number of processors for a new cluster. Defaults to all processors of this machine, and is ignored if
            ``address`` is given.

    Raises:
        ClusterConnectionError: No cluster responds at the address, or Ray cannot start.
    """
    if ray.is_initialized():
        yield
        return
    if address is not None and address != "auto":
        _check_address(address)
    arguments: dict[str, Any] = {"address": address}
    if address is None:
        arguments = {
            "address": "local",
            "num_cpus": num_cpus,
            "include_dashboard": False,
            "object_store_memory": OBJECT_STORE,
            "_node_ip_address": LOOPBACK,
        }
    with ExitStack() as stack:
        stack.callback(_read_authentication)  # runs last, when the environment variables have been restored
        stack.enter_context(variables(_ALWAYS if address else _ALWAYS | _LOCAL))
        stack.enter_context(quiet())
        _read_authentication()
        with _handlers_kept():
            try:
                with _without_banner():
                    ray.init(logging_level=logging.ERROR, log_to_driver=False, configure_logging=False, **arguments)
            except (OSError, RuntimeError, ValueError, AuthenticationError, RaySystemError, RpcError) as error:
                raise ClusterConnectionError(address, f"{error}") from error
        try:
            yield
        finally:
            with _handlers_kept():
                ray.shutdown()


def _check_address(address: str) -> None:
    """Raise ClusterConnectionError if no server listens on ``host:port``.

    Without this check, Ray would retry for a minute.
    """
    host, _, port = address.rpartition(":")
    if "://" in address or not host or not port.isdecimal():
        raise ClusterConnectionError(address, "the address must be 'host:port' of the head node, or 'auto'")
    try:
        socket.create_connection((host.strip("[]"), int(port)), _TIMEOUT).close()
    except (OSError, OverflowError) as error:
        raise ClusterConnectionError(address, f"{error}") from error


@contextmanager
def variables(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables that the user has not set, and remove them at the end of the block."""
    added = [name for name in values if name not in os.environ]
    set_by_ray = [name for name in ("PYTHONBREAKPOINT",) if name not in os.environ]
    os.environ.update({name: values[name] for name in added})
    try:
        yield
    finally:
        for name in (*added, *set_by_ray):
            os.environ.pop(name, None)


def _read_authentication() -> None:
    """Make Ray reread its authentication mode and token from the environment, which Ray otherwise reads only once."""
    compiled: Any = import_module("ray._raylet")
    compiled.Config.initialize("")
    compiled.AuthenticationTokenLoader.instance().reset_cache()


@contextmanager
def quiet(names: Sequence[str] = ("ray", "ray.rllib", "ray.tune"), level: int = logging.ERROR) -> Iterator[None]:
    """Suppress messages below a level from loggers, by default those from Ray and its libraries except for errors."""
    loggers = [logging.getLogger(name) for name in names]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(level)
    try:
        yield
    finally:
        for logger, earlier in zip(loggers, before, strict=True):
            logger.setLevel(earlier)


@contextmanager
def _without_banner() -> Iterator[None]:
    """Remove the line about the log level that Ray's C++ code writes to stderr, and keep all other output."""
    sys.stderr.flush()
    stderr = os.dup(2)
    try:
        with tempfile.TemporaryFile() as file:
            os.dup2(file.fileno(), 2)
            try:
                yield
            finally:
                sys.stderr.flush()
                os.dup2(stderr, 2)
                file.seek(0)
                os.write(2, b"".join(line for line in file if _BANNER not in line))
    finally:
        os.close(stderr)


@contextmanager
def _handlers_kept() -> Iterator[None]:
    """Restore the SIGTERM handler that Ray replaces."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Ray cannot replace the handler outside the main thread
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
