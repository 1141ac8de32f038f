"""The number of threads on which JAX computes."""

from __future__ import annotations

import logging
import os

import jax

_log = logging.getLogger("frobs")
_VARIABLE = "NPROC"
"""Environment variable from which XLA takes the size of its thread pool, once for each process."""

_chosen: int | None = None


def set_threads(count: int) -> None:
    """Make JAX compute on ``count`` threads of this process's processors.

    Without a limit, XLA uses as many threads as there are processors when it starts. Their number affects the rounding
    of matrix products, so a training run that continues on another machine would differ. XLA starts once per process.
    If it already runs with another number of threads, a warning is logged and nothing changes.
    """
    global _chosen
    if not _starts():
        if _chosen != count:
            running = "another number of" if _chosen is None else str(_chosen)
            _log.warning(
                "JAX already runs with %s threads in this process, so torch_threads = %s has no effect.", running, count
            )
        return
    before = os.environ.get(_VARIABLE)
    os.environ[_VARIABLE] = str(count)
    try:
        jax.local_devices(backend="cpu")
    finally:
        if before is None:
            del os.environ[_VARIABLE]
        else:
            os.environ[_VARIABLE] = before
    _chosen = count


def _starts() -> bool:
    """Return whether XLA has not started yet."""
    if _chosen is not None:
        return False
    try:
        jax.config.update("jax_num_cpu_devices", 1)  # type: ignore[no-untyped-call]  # only accepted before XLA starts
    except RuntimeError:
        return False
    return True
