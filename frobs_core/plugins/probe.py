"""Importing one plugin in a process of its own, with a time limit: what it costs, prints and changes."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from frobs_core.plugins.discovery import Candidate

NO_PLUGINS = "FROBS_NO_PLUGINS"
"""Environment variable: with a value, importing :mod:`frobs_core` loads no plugin."""

GRACE = 10.0
"""[s] that the process has beyond the plugin's time: to start, and to be ended by itself."""

_TORCH = "import torch; print(torch.get_num_threads())"


@dataclass(frozen=True, kw_only=True)
class Probe:
    """What was seen of one plugin.

    Attributes:
        state: ``"loaded"``, ``"failed"``, ``"hanging"`` or ``"crashed"``: the process died.
        cause: One line that says why it is not loaded.
        traceback: Of the failure, or of where it hangs.
        import_seconds: How long its import took [s].
        records: Names of its records, by kind.
        environment_ids: Of its tasks.
        stdout: What it printed.
        stderr: What it printed there.
        changed: What it changed that belongs to the whole process: ``"working directory"``, ``"random state"``, …
        modules: Top-level modules that it imported.
        warnings: That it caused: category, message, file and line.
        missing_module: That it could not import.
    """

    state: str
    cause: str = ""
    traceback: str = ""
    import_seconds: float = 0.0
    records: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    environment_ids: tuple[str, ...] = ()
    stdout: str = ""
    stderr: str = ""
    changed: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    warnings: tuple[Mapping[str, str], ...] = ()
    missing_module: str = ""


def probe(candidate: Candidate, seconds: float = 30.0) -> Probe:
    """Import a plugin in a process of its own, in which no other plugin is loaded.

    Args:
        candidate: Its entry point.
        seconds: That it may take.
    """
    if candidate.problem:
        return Probe(state="failed", cause=candidate.problem)
    with tempfile.TemporaryDirectory(prefix="frobs-probe-") as folder:
        findings = Path(folder) / "findings.json"
        with (Path(folder) / "stdout").open("w+b") as out, (Path(folder) / "stderr").open("w+b") as err:
            code = _run(candidate, findings, seconds, out, err)
            out_text, err_text = _text(out), _text(err)
        if findings.exists():
            return _probe(json.loads(findings.read_text()), out_text, err_text)
        hangs = Path(f"{findings}.hangs")
        where = hangs.read_text() if hangs.exists() else ""
        if where or code is None:
            cause = f"its import had not ended after {seconds:g} s"
            return Probe(
                state="hanging", cause=cause, traceback=where, import_seconds=seconds, stdout=out_text, stderr=err_text
            )
        died = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        cause = f"its import ended the process {died}"
        return Probe(state="crashed", cause=cause, traceback=err_text, stdout=out_text, stderr=err_text)


def _run(candidate: Candidate, findings: Path, seconds: float, out: IO[bytes], err: IO[bytes]) -> int | None:
    """Run the child to its end; its exit code, or None where it had to be killed."""
    command = [sys.executable, "-m", "frobs_core.plugins.child"]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
        NO_PLUGINS: "1",
    }
    child = subprocess.Popen(
        [*command, candidate.value, candidate.key, str(findings), str(seconds)],
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=err,
        env=environment,
        start_new_session=True,
    )
    try:
        return child.wait(timeout=seconds + GRACE)
    except subprocess.TimeoutExpired:
        return None
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)  # with whatever it has started
        child.wait()


def _probe(found: Mapping[str, Any], stdout: str, stderr: str) -> Probe:
    changed = list(found["changed"])
    if found["torch_threads"] and found["torch_threads"] != _usual_torch_threads():
        changed.append("torch threads")
    return Probe(
        state=found["state"],
        cause=found["cause"],
        traceback=found["traceback"],
        import_seconds=found["import_seconds"],
        records={kind: tuple(names) for kind, names in found.get("records", {}).items()},
        environment_ids=tuple(found.get("environment_ids", ())),
        changed=tuple(changed),
        modules=tuple(found["modules"]),
        warnings=tuple(found["warnings"]),
        missing_module=found.get("missing_module", ""),
        stdout=stdout,
        stderr=stderr,
    )


@lru_cache(maxsize=1)
def _usual_torch_threads() -> int:
    """Return how many threads torch has where nobody touches it."""
    return int(subprocess.run([sys.executable, "-c", _TORCH], capture_output=True, text=True, check=True).stdout)


def _text(stream: IO[bytes]) -> str:
    stream.seek(0)
    return stream.read(20_000).decode(errors="replace")
