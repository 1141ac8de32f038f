"""Configuration of the number of threads that JAX uses."""

from __future__ import annotations

import logging
import os

import jax

_log = logging.getLogger("frobs")
_VARIABLE = "NPROC"
"""Environment variable from which XLA reads the size of its thread pool, once per process."""

_chosen: int | None = None


def set_threads(count: int) -> None:
    """Make JAX use ``count`` threads in this process.

    Without a limit, XLA uses one thread for each processor that is available when XLA starts. The number of threads
    affects the rounding of matrix products, so without a limit, the results of a training run would change if the run
    was resumed on another machine. XLA starts only once per process. If XLA is already running with a different number
    of threads, a warning is logged and the number of threads does not change.
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
    if _chosen is not None:
        return False
    try:
        # JAX raises an error if XLA has already started.
        jax.config.update("jax_num_cpu_devices", 1)  # type: ignore[no-untyped-call]
    except RuntimeError:
        return False
    return True
