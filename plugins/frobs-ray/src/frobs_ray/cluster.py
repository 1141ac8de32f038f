"""Connecting to a Ray cluster, or starting one on this machine."""

from __future__ import annotations

import logging
import os
import secrets
import signal
import socket
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from importlib import import_module
from typing import Any

import ray
from ray.exceptions import AuthenticationError, RaySystemError, RpcError

from frobs_ray.errors import ClusterConnectionError

LOOPBACK = "127.0.0.1"
OBJECT_STORE = 512 * 2**20
"""Shared memory of a cluster on this machine [bytes]; it is allocated when it is used, and excess data go to disk."""

_ALWAYS = {
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # Ray's new behavior; without the variable Ray prints a warning
    "RAY_BACKEND_LOG_LEVEL": "fatal",  # Ray's C++ code prints warnings to stderr
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",  # workers use this environment and do not copy the working folder
}
# Ray listens on all network interfaces. A token of this process protects a cluster on this machine; otherwise Ray would
# write one to the user's home directory.
_LOCAL = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32), "RAY_USAGE_STATS_ENABLED": "0"}
_BANNER = b"Set ray log level from environment variable"
_TIMEOUT = 10.0  # [s] for the first connection to a head node


@contextmanager
def connect(address: str | None = None, num_cpus: int | None = None) -> Iterator[None]:
    """Connect this process to a Ray cluster while the ``with`` block runs.

    If this process is already connected, the existing connection is used and stays open afterwards. Ray's messages are
    suppressed, and the caller's handlers of Ctrl-C and SIGTERM stay in place.

    Args:
        address: ``"host:port"`` of the head node, or ``"auto"`` for the cluster that is running on this machine. None:
            start a cluster on this machine and stop it at the end of the block.
        num_cpus: Number of processors of a new cluster; None: all of this machine. Ignored if there is an address.

    Raises:
        ClusterConnectionError: No cluster answers at the address, or Ray cannot start.
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
        stack.callback(_read_authentication)  # after the variables are restored
        stack.enter_context(_variables(_ALWAYS if address else _ALWAYS | _LOCAL))
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
    """Raise ClusterConnectionError unless a server listens at ``host:port``; Ray itself would retry for a minute."""
    host, _, port = address.rpartition(":")
    if "://" in address or not host or not port.isdecimal():
        raise ClusterConnectionError(address, "the address must be 'host:port' of the head node, or 'auto'")
    try:
        socket.create_connection((host.strip("[]"), int(port)), _TIMEOUT).close()
    except (OSError, OverflowError) as error:
        raise ClusterConnectionError(address, f"{error}") from error


@contextmanager
def _variables(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables that the user has not set, and remove them at the end."""
    added = [name for name in values if name not in os.environ]
    set_by_ray = [name for name in ("PYTHONBREAKPOINT",) if name not in os.environ]
    os.environ.update({name: values[name] for name in added})
    try:
        yield
    finally:
        for name in (*added, *set_by_ray):
            os.environ.pop(name, None)


def _read_authentication() -> None:
    """Make Ray read its authentication mode and token from the environment again; by default it does so only once."""
    compiled: Any = import_module("ray._raylet")
    compiled.Config.initialize("")
    compiled.AuthenticationTokenLoader.instance().reset_cache()


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress messages of Ray and its libraries below errors in this process."""
    loggers = [logging.getLogger(name) for name in ("ray", "ray.rllib", "ray.tune")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


@contextmanager
def _without_banner() -> Iterator[None]:
    """Drop the line of Ray's C++ code that reports its log level; pass on everything else that is written to stderr."""
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
    """Preserve the handler of SIGTERM, which Ray replaces."""
    if threading.current_thread() is not threading.main_thread():
        yield  # in another thread, Ray cannot replace it either
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
