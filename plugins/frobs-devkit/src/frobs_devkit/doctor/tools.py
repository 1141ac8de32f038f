"""Candidate links for the tool center point, and their reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from frobs_core.models import TOOL_NAMES, RobotModel, default_tcp, joint_path, longest_reach, usual_rank
from frobs_core.util.arrays import Floats
from frobs_devkit.doctor.robot_report import Finding, Severity, ToolCandidate

_SAMPLES = 2000
_TURN = math.pi  # [rad] range in both directions for a joint without limits
_SLIDE = 1.0  # [m] range in both directions for a prismatic joint without limits


def tool_candidates(model: RobotModel, tcp: str | None = None) -> tuple[ToolCandidate, ...]:
    """Return the links at the ends of kinematic chains and the links with common tool names, most likely first.

    The ``tcp`` is declared in the robot's description, or None.
    """
    parents = {joint.parent for joint in model.joints}
    moving, chosen, drawn = set(model.joint_names), tcp or default_tcp(model), _random_positions(model)
    ranked = []
    for link in model.links:
        usual = usual_rank(link.name)
        if link.name in parents and not usual and link.name != chosen:
            continue
        path = joint_path(model, link.name)
        actuated = sum(joint.name in moving for joint in path)
        bound = longest_reach(model, link.name)
        candidate = ToolCandidate(
            link=link.name,
            actuated_joints=actuated,
            usual_name=usual > 0,
            reach=float(np.linalg.norm(model.frame_pose(link.name, drawn)[0], axis=1).max()),
            longest_reach=bound if math.isfinite(bound) else None,
            chosen=link.name == chosen,
        )
        ranked.append(((candidate.chosen, actuated, usual, len(path)), candidate))
    ranked.sort(key=lambda pair: pair[0], reverse=True)  # a stable sort: equally likely links keep the file's order
    return tuple(candidate for _, candidate in ranked)


def tool_findings(model: RobotModel, tools: tuple[ToolCandidate, ...]) -> Iterator[Finding]:
    """Yield a finding if the tool link was guessed."""
    if not tools[0].actuated_joints or tools[0].usual_name:
        return
    others = [f"'{tool.link}'" for tool in tools[1:] if tool.actuated_joints]
    if others:
        more = f" and {len(others) - 3} more" if len(others) > 3 else ""
        yield Finding(
            "which-tool",
            Severity.NOTE,
            f"link '{tools[0].link}'",
            "the link is used as the tool because it is moved by the most joints; other candidates are "
            f"{', '.join(others[:3])}{more}",
            f"choose the tool with tcp=LINK; links with names such as {', '.join(TOOL_NAMES[:3])} are recognized "
            "automatically",
        )


def _random_positions(model: RobotModel) -> Floats:
    """Return random joint positions (n, dof) within the limits, including the limits themselves."""
    low, high = [], []
    for joint in model.actuated_joints:
        far = _SLIDE if joint.type.value == "prismatic" else _TURN
        low.append(joint.limits.lower if math.isfinite(joint.limits.lower) else -far)
        high.append(joint.limits.upper if math.isfinite(joint.limits.upper) else far)
    samples = _SAMPLES if low else 1
    share = np.random.default_rng(0).uniform(-0.1, 1.1, (samples, len(low))).clip(0.0, 1.0)
    drawn: Floats = np.array(low) + share * (np.array(high) - np.array(low))
    return drawn
