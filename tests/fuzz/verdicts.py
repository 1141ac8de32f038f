"""Decides what was wrong with the run of a command."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cases import Case

TRACEBACK = "Traceback (most recent call last)"
EXIT_CODES = (0, 1, 2)
ERRORS: Mapping[int, set[int]] = {1: {0, 1}, 2: {1}}
"""Allowed numbers of error lines by exit code. With code 1, a check or one of several jobs failed."""

LONGEST = 4_000
"""Maximum length of an error line [characters]."""

CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\udc80-\udcff]")
"""Control characters that no terminal should receive, and bytes that are not UTF-8."""

INTERNAL = re.compile(
    r"'NoneType' object|\b(Attribute|Type|Key|Index|Assertion|Recursion|UnboundLocal|ZeroDivision|Unicode\w*|Lookup|Memory)Error\b"
    r"|object is not (iterable|subscriptable|callable)|has no attribute '|unsupported operand|list index out of range"
)
"""Texts of Python's own errors, which tell a reader nothing about the file."""

WORKING = re.compile(
    r"in (step|reset|learn|train|collect_rollouts|rollout|predict|act|run_episodes|render|measure\w*|optimize|_?export\w*|closed_loop)$",
    re.MULTILINE,
)
"""Functions that simulate, train or export what the user asked for: they may take as long as they need."""

WORKERS = {"train", "resume", "evaluate", "play", "tune", "compare", "export", "check", "bench", "parity", "ros run"}
"""Commands that simulate or train."""

TRUSTED = {"yaml", "run", "package", "command"}
"""Kinds of inputs that may name modules to import (SECURITY.md)."""


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        symptom: Traceback, hang, growth, control, exit code, error line, unclear, JSON, write, execution or network.
        detail: What was seen.
        place: Source line that is responsible, or the command.
    """

    symptom: str
    detail: str
    place: str

    @property
    def group(self) -> tuple[str, str]:
        """Key of faults that probably have the same cause."""
        return self.symptom, self.place


def judge(
    case: Case, words: Sequence[str], result: Mapping[str, Any], expected: frozenset[str] = frozenset()
) -> list[Fault]:
    """Return what was wrong.

    Args:
        case: The case.
        words: Its command line.
        result: Result of :meth:`server.Server.run`.
        expected: Events, as ``WHAT DETAIL``, that valid inputs cause too.
    """
    found = []
    out, err = result["stdout"], result["stderr"]
    if TRACEBACK in out + err:
        found.append(Fault("traceback", _last_line(err), _frame(err)))
    if result["killed"] == "growth":
        found.append(Fault("growth", f"{result['growth'] >> 20} MiB", _frame(result["stack"]) or case.command))
    elif result["killed"] in ("slow", "blocked") and not _works(case, result["stack"]):
        found.append(
            Fault(
                "hang",
                f"{result['killed']} after {result['cpu']} s",
                _frame(result["stack"], first=True) or case.command,
            )
        )
    elif not result["killed"] and result["code"] not in EXIT_CODES:
        found.append(Fault("exit code", str(result["code"]), case.command))
    if hit := CONTROL.search(out) or CONTROL.search(err):
        shown = (out if CONTROL.search(out) else err)[max(0, hit.start() - 60) : hit.end() + 20]
        found.append(Fault("control", repr(shown), f"{case.command}: {_shape(shown[:60])}"))
    errors = [line for line in err.splitlines() if line.startswith("error: ")]
    if not result["killed"] and TRACEBACK not in err:
        if len(errors) not in ERRORS.get(result["code"], {0}):
            found.append(Fault("error line", f"exit code {result['code']}, {len(errors)} error lines", case.command))
        if result["code"] == 1 and not (out + err).strip():
            found.append(Fault("error line", "exit code 1 without a message", case.command))
        if "--json" in words and result["code"] == 0 and "--help" not in words and not _is_json(out):
            found.append(Fault("JSON", out[:200], case.command))
    if errors and max(map(len, errors)) > LONGEST:
        found.append(
            Fault("unclear", f"an error of {max(map(len, errors))} characters: {errors[0][:100]}", _shape(errors[0]))
        )
    if errors and (hit := INTERNAL.search(errors[0])) and hit.group() not in " ".join(words):
        found.append(Fault("unclear", errors[0][:300], _shape(errors[0])))
    for what, detail in result["events"]:
        if f"{what} {detail}" in expected or (what == "program" and f"program {_program(detail)}" in expected):
            continue
        if what in ("write", "network"):
            found.append(Fault(what, detail, case.command))
        elif what == "program" or (what == "code" and case.kind not in TRUSTED) or what == "pickle":
            found.append(Fault("execution", f"{what}: {detail}", case.command))
    return list(dict.fromkeys(found))


def events(result: Mapping[str, Any]) -> set[str]:
    """Return the events of the run of a valid input, which are not faults."""
    found = {f"{what} {detail}" for what, detail in result["events"] if what in ("pickle", "program")}
    return found | {f"program {_program(detail)}" for what, detail in result["events"] if what == "program"}


def _program(detail: str) -> str:
    """Return the program of a Popen event and its first argument."""
    return " ".join(re.findall(r"'([^']*)'", detail)[:3])


def _works(case: Case, stack: str) -> bool:
    return case.command in WORKERS and WORKING.search(stack) is not None


def _is_json(text: str) -> bool:
    def reject(constant: str) -> None:
        raise ValueError(constant)

    try:
        json.loads(text, parse_constant=reject)
    except (ValueError, RecursionError):
        return False
    return True


def _last_line(text: str) -> str:
    return next((line for line in reversed(text.splitlines()) if line.strip()), "")[:300]


def _frame(text: str, *, first: bool = False) -> str:
    """Return the innermost frame of a traceback or stack that belongs to FRobs; ``first``: the innermost comes first."""
    frames = re.findall(r'File "([^"]+)", line (\d+),? in (\S+)', text)
    ours = [
        frame for frame in frames if re.search(r"/frobs_\w+/", frame[0]) and "/frobs_cli/" not in frame[0]
    ] or frames
    if not ours:
        return ""
    file, _, function = ours[0 if first else -1]
    name = "/".join(Path(file).parts[-2:])
    return f"{name}:{function}"


def _shape(line: str) -> str:
    """Return a message without its names and numbers, to group messages."""
    text = re.sub(r"\x1b\[[\d;]*m", "", line)
    return re.sub(r"\d+", "N", re.sub(r"'[^']*'|\"[^\"]*\"|\S*/\S*", "…", text))[:80]
