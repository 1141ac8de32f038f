"""The figure of a step: every call of FRobs that one step of reaching makes, drawn from a trace."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path
from types import FrameType
from typing import Any

import gymnasium as gym
from layers import ROOT, distributions

from generate.step_files import ID

_LANE, _ROW, _TOP, _MARGIN = 196, 24, 84, 20
_TITLE = f"Calls of one step of {ID} in MuJoCo, from top to bottom, with a column for each source file"

_STYLE = """
    text { font-family: system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif; fill: #22272e; }
    .name { font-size: 13px; font-weight: 600; }
    .note { font-size: 11px; fill: #57606a; }
    .code { font-family: ui-monospace, 'SF Mono', Menlo, 'DejaVu Sans Mono', monospace; font-size: 11px; paint-order: stroke; stroke: #ffffff; stroke-width: 4px; }
    .ground { fill: #f6f8fa; }
    .lane { fill: #ffffff; stroke: #d0d7de; }
    .line { fill: none; stroke: #b1bac4; stroke-width: 1.3; }
    .dot { fill: #e8590c; }
    @media (prefers-color-scheme: dark) {
      text { fill: #e6edf3; }
      .note { fill: #9da7b3; }
      .ground { fill: #161b22; }
      .lane { fill: #1c2128; stroke: #444c56; }
      .code { stroke: #1c2128; }
      .line { stroke: #57606a; }
    }
"""


@dataclass(frozen=True)
class Call:
    """A call of a function.

    Attributes:
        file: Source file, relative to the repository.
        function: Name of the function, with its class.
        caller: Index of the call that made this one, or −1.
    """

    file: Path
    function: str
    caller: int


def traced_calls() -> list[Call]:
    """Return the calls of FRobs in one step of ``ID`` without wrappers, in their order."""
    env = gym.make(f"frobs_core:{ID}", simulator="mujoco").unwrapped
    env.reset(seed=0)
    action = env.action_space.sample()
    env.step(action)  # the first step may still import something
    calls = _calls_of(lambda: env.step(action))
    env.close()
    return calls


def figure() -> str:
    """Return the figure as SVG."""
    calls = traced_calls()
    lanes = {file: number for number, file in enumerate(dict.fromkeys(call.file for call in calls))}
    width, height = 2 * _MARGIN + len(lanes) * _LANE, _TOP + len(calls) * _ROW + 2 * _MARGIN
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        f'role="img" aria-label="{_TITLE}">',
        f"  <title>{_TITLE}</title>",
        f"  <style>{_STYLE}  </style>",
        f'  <rect class="ground" width="{width}" height="{height}" rx="14"/>',
    ]
    for file, number in lanes.items():
        x, middle = _MARGIN + number * _LANE, _MARGIN + (number + 0.5) * _LANE
        parts += [
            f'  <rect class="lane" x="{x + 4}" y="{_MARGIN}" width="{_LANE - 8}" height="{height - 2 * _MARGIN}" rx="8"/>',
            f'  <text class="name" x="{middle}" y="{_MARGIN + 24}" text-anchor="middle">{escape(file.name)}</text>',
            f'  <text class="note" x="{middle}" y="{_MARGIN + 42}" text-anchor="middle">{_owner(file)}</text>',
        ]
    places = [(_MARGIN + lanes[call.file] * _LANE + 18, _TOP + row * _ROW + 16) for row, call in enumerate(calls)]
    for call, (x, y) in zip(calls, places, strict=True):
        if call.caller >= 0:
            above_x, above_y = places[call.caller]
            parts.append(f'  <path class="line" d="M{above_x} {above_y + 4}V{y}H{x}"/>')
    for call, (x, y) in zip(calls, places, strict=True):
        parts.append(f'  <circle class="dot" cx="{x}" cy="{y}" r="3.5"/>')
        parts.append(f'  <text class="code" x="{x + 9}" y="{y + 4}">{escape(_short(call.function))}</text>')
    return "\n".join([*parts, "</svg>", ""])


def _owner(file: Path) -> str:
    """Return the distribution of a file."""
    return file.parts[1] if file.parts[0] == "plugins" else "frobs-core"


def _short(function: str) -> str:
    """Return a function's name as a reader would write it, such as ``Reach.reward`` or ``observation_terms: λ``."""
    outer, _, inner = function.rpartition(".<locals>.")
    if not outer or not inner.startswith("<"):
        return inner
    return f"{outer.rpartition('.')[2]}: {'λ' if inner == '<lambda>' else '[…]'}"


def _calls_of(function: Callable[[], Any]) -> list[Call]:
    packages = [str(package) for distribution in distributions().values() for package in distribution.packages]
    calls: list[Call] = []
    stack: list[int] = []

    def record(frame: FrameType, event: str, argument: Any) -> None:
        file = frame.f_code.co_filename
        if event not in ("call", "return") or not file.startswith(tuple(packages)):
            return
        if event == "call":
            name = frame.f_code.co_qualname
            calls.append(Call(Path(file).relative_to(ROOT), name, stack[-1] if stack else -1))
            stack.append(len(calls) - 1)
        else:
            stack.pop()

    earlier = sys.getprofile()
    sys.setprofile(record)
    try:
        function()
    finally:
        sys.setprofile(earlier)
    return calls
