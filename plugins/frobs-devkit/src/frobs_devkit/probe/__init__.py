"""Imports one plugin in a separate process with a time limit, and reports its import time, output and side effects."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

from frobs_core.plugins import Candidate

__all__ = ["GRACE", "NO_PLUGINS", "Probe", "probe"]

NO_PLUGINS = "FROBS_NO_PLUGINS"
"""Environment variable that, if set, prevents ``frobs_core`` from loading plugins when it is imported."""

GRACE = 10.0
"""Time for starting and exiting the process, in addition to the time limit [s]."""

_TORCH = "import torch; print(torch.get_num_threads())"


@dataclass(frozen=True, kw_only=True)
class Probe:
    """Findings about one plugin.

    Attributes:
        state: ``"loaded"``, ``"failed"``, ``"hanging"`` or ``"crashed"`` (the process died).
        cause: One-line reason why the plugin is not loaded.
        traceback: Traceback of the failure, or stack trace of the hanging import.
        import_seconds: Duration of the plugin's import [s].
        records: Names of the plugin's records, by kind.
        environment_ids: Environment IDs of the plugin's tasks.
        stdout: The plugin's output on stdout.
        stderr: The plugin's output on stderr.
        changed: Global state that the plugin changed, such as ``"working directory"`` or ``"random state"``.
        modules: Top-level modules that the plugin imported.
        warnings: Warnings that the plugin caused, each with category, message, file and line.
        missing_module: Module that the plugin could not import.
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
    """Import a plugin in a separate process without other plugins.

    Args:
        candidate: Entry point of the plugin.
        seconds: Time limit [s].
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
            cause = f"the import did not finish within {seconds:g} s"
            hanging = Probe(state="hanging", cause=cause, traceback=where, import_seconds=seconds)
            return replace(hanging, stdout=out_text, stderr=err_text)
        died = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        cause = f"the import ended the process {died}"
        return Probe(state="crashed", cause=cause, traceback=err_text, stdout=out_text, stderr=err_text)


def _run(candidate: Candidate, findings: Path, seconds: float, out: IO[bytes], err: IO[bytes]) -> int | None:
    """Run the child process and return its exit code, or None if the process had to be killed."""
    command = [sys.executable, "-m", "frobs_devkit.probe.child"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path), NO_PLUGINS: "1"}
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
            os.killpg(child.pid, signal.SIGKILL)  # also kills all processes that the child started
        child.wait()


def _probe(found: dict[str, Any], stdout: str, stderr: str) -> Probe:
    threads = found.pop("torch_threads")
    if threads and threads != _usual_torch_threads():
        found["changed"].append("torch threads")
    records = {kind: tuple(names) for kind, names in found.pop("records", {}).items()}
    facts: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in found.items()}
    return Probe(**facts, records=records, stdout=stdout, stderr=stderr)


@lru_cache(maxsize=1)
def _usual_torch_threads() -> int:
    return int(subprocess.run([sys.executable, "-c", _TORCH], capture_output=True, text=True, check=True).stdout)


def _text(stream: IO[bytes]) -> str:
    stream.seek(0)
    return stream.read(20_000).decode(errors="replace")
