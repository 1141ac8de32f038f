"""Main module of the separate process in which :mod:`.probe` examines one plugin.

This module prints nothing, so all output on stdout and stderr comes from the plugin. Findings are written to a file.
"""

from __future__ import annotations

import faulthandler
import json
import locale
import logging
import multiprocessing
import os
import random
import signal
import sys
import threading
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from frobs_core.plugins import environment_ids, import_plugin, read_records

_ACTS = {"os.chdir": "working directory", "os.putenv": "environment", "os.unsetenv": "environment"}
_OPENS = {"socket.connect": "the network", "subprocess.Popen": "another program", "os.system": "another program"}


def state() -> dict[str, object]:
    """Return the process's global state in a comparable form."""
    return {
        "working directory": os.getcwd(),
        "environment": dict(os.environ),
        "random state": [repr(random.getstate()), repr(np.random.get_state())],  # noqa: NPY002 - the global state
        "warning filters": [repr(warnings.filters), warnings.showwarning],
        "signal handlers": [signal.getsignal(number) for number in signal.valid_signals()],
        "numpy error state": repr(np.geterr()),
        "numpy print options": repr(np.get_printoptions()),
        "standard streams": [id(stream) for stream in (sys.stdin, sys.stdout, sys.stderr)],
        "module search path": list(sys.path),
        "exception hooks": [sys.excepthook, threading.excepthook],
        "root logger": [logging.root.level, len(logging.root.handlers), logging.root.manager.disable],
        "locale": locale.setlocale(locale.LC_ALL),
        "recursion limit": sys.getrecursionlimit(),
        "threads": threading.active_count(),
        "Gymnasium's registry": sorted(gymnasium.registry),
        "default multiprocessing start method": multiprocessing.get_start_method(allow_none=True),
    }


def main(module: str, key: str, findings: Path, seconds: float) -> None:
    """Import a plugin ``"distribution:name"``, call its hooks, and write the findings to a JSON file.

    After ``seconds``, the process writes its stack trace to the same path with the suffix ``.hangs`` and exits.
    """
    acts: list[str] = []
    importing = True

    def watch(event: str, _: Any) -> None:
        if importing and event in _ACTS:
            acts.append(_ACTS[event])
        elif importing and event in _OPENS:
            acts.append(f"it opens {_OPENS[event]}")

    caught: list[dict[str, str]] = []
    warnings.filterwarnings("always", category=DeprecationWarning)
    warnings.filterwarnings("always", category=FutureWarning)
    warnings.showwarning = lambda message, category, filename, line, *_: caught.append(
        {"category": category.__name__, "message": str(message), "file": filename, "line": str(line)}
    )
    seen, before = set(sys.modules), state()
    sys.addaudithook(watch)
    facts: dict[str, Any] = {"state": "loaded", "cause": "", "traceback": "", "import_seconds": 0.0}
    with open(f"{findings}.hangs", "w") as where:
        faulthandler.dump_traceback_later(seconds, exit=True, file=where)
        start = time.perf_counter()
        try:
            plugin = import_plugin(module)
            facts["import_seconds"] = time.perf_counter() - start
            records = read_records(plugin, key)
            facts["records"] = {kind: [record.name for record in offered] for kind, offered in records.items()}
            facts["environment_ids"] = list(environment_ids(records))
        except BaseException as error:  # including SystemExit
            facts |= {
                "state": "failed",
                "cause": f"{type(error).__name__}: {next(iter(str(error).strip().splitlines()), '')}".rstrip(": "),
                "traceback": "".join(traceback.format_exception(error)),
                "import_seconds": facts["import_seconds"] or time.perf_counter() - start,
                "missing_module": error.name or "" if isinstance(error, ModuleNotFoundError) else "",
            }
        faulthandler.cancel_dump_traceback_later()
    importing = False
    after = state()
    facts["changed"] = sorted({*acts, *(name for name in before if before[name] != after[name])})
    facts["modules"] = sorted({name.partition(".")[0] for name in set(sys.modules) - seen})
    facts["warnings"] = caught
    torch = sys.modules.get("torch")
    facts["torch_threads"] = getattr(torch, "get_num_threads", int)()
    findings.write_text(json.dumps(facts, allow_nan=False))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), float(sys.argv[4]))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # exits without waiting for the plugin's threads or running its exit handlers
