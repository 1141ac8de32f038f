"""The open and the closed positions of a gripper are swapped: it lets go when it shall grasp."""

from __future__ import annotations

from dataclasses import replace

from arm_and_gripper import ARM, FINGERS

_tool = FINGERS.end_effectors["fingers"]
_swapped = replace(FINGERS, end_effectors={"fingers": replace(_tool, open=_tool.closed, closed=_tool.open)})

FAULTY = ARM.attach("flange", _swapped)
