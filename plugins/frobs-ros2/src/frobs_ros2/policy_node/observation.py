"""Assembles observations from topics, as a bundle describes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from frobs_deploy import Manifest
from frobs_ros2.policy_node.kinematics import Kinematics

Array = np.ndarray[Any, Any]

_TOOL = ("tcp_position", "achieved_goal", "goal_offset", "goal_from_shoulder")
_GOAL = ("goal", "desired_goal", "goal_offset", "goal_from_shoulder")
_JOINTS = ("joint_positions", "joint_velocities", "joint_efforts")


@dataclass
class Inputs:
    """The latest content of the topics.

    Attributes:
        stamp: Time of the joint state [s].
        joint_positions: (dof,) [rad or m]
        joint_velocities: (dof,) [rad/s or m/s]
        joint_efforts: (dof,) [N·m or N]
        goal: Position of the goal in the robot's root frame, (3,) [m], or None.
        named: Numbers from the topic ``observation``, by name.
        named_stamp: Time of these numbers [s].
        images: Images by observation key.
    """

    stamp: float = -np.inf
    joint_positions: Array = field(default_factory=lambda: np.zeros(0))
    joint_velocities: Array = field(default_factory=lambda: np.zeros(0))
    joint_efforts: Array = field(default_factory=lambda: np.zeros(0))
    goal: Array | None = None
    named: dict[str, Array] = field(default_factory=dict)
    named_stamp: float = -np.inf
    images: dict[str, Array] = field(default_factory=dict)


def named_arrays(names: Sequence[str], values: Sequence[float]) -> dict[str, Array]:
    """Return numbers that are named ``"term/0"``, ``"term/1"``, … in any order as one array per term."""
    parts: dict[str, list[float]] = {}
    for name, value in sorted(zip(names, values, strict=False), key=lambda pair: _number(pair[0])):
        parts.setdefault(name.partition("/")[0], []).append(value)
    return {name: np.array(part, float) for name, part in parts.items()}


def _number(name: str) -> int:
    """Return the number of an element from its name, such as 3 for ``"term/3"``."""
    number = name.rpartition("/")[2]
    return int(number) if number.isdecimal() else 0


class Observer:
    """Computes the observation of a bundle.

    Joint terms come from ``joint_states``, the tool's position from the robot description, the goal from ``goal`` or a
    setting, and all other terms from ``observation``.

    Args:
        manifest: Manifest of the bundle.
        tcp: Link that is the tool center point.
        kinematics: Kinematics of the robot, or None if there is no robot description.
    """

    def __init__(self, manifest: Manifest, tcp: str, kinematics: Kinematics | None) -> None:
        self._manifest = manifest
        flat = manifest.observation.get("") or manifest.observation.get("observation")
        self._bounds: dict[str, tuple[Array, Array]] = {}
        if flat is not None:
            low, high = (np.broadcast_to(bound, flat.shape) for bound in (flat.low, flat.high))
            self._bounds = {name: (low[part], high[part]) for name, part in manifest.terms.items()}
        self._keys = [key for key in manifest.observation if key not in ("", "observation", *manifest.images)]
        self.widths = {name: columns.stop - columns.start for name, columns in manifest.terms.items()}
        self.widths |= {key: int(np.prod(manifest.observation[key].shape)) for key in self._keys}
        self._arm = kinematics.chain(tcp) if kinematics is not None and kinematics.has_link(tcp) else None

    def needs(self, *names: str) -> bool:
        """Return whether the observation contains any of the terms."""
        return any(name in self.widths for name in names)

    @property
    def needs_goal(self) -> bool:
        """Whether the observation depends on a goal."""
        return self.needs(*_GOAL)

    @property
    def needs_tool(self) -> bool:
        """Whether the observation depends on the tool's position."""
        return self.needs(*_TOOL)

    def others(self) -> list[str]:
        """Return the terms that must come from the topic ``observation``."""
        known = {*_JOINTS, *(_TOOL if self._arm is not None else ()), *_GOAL}
        return [name for name in self.widths if name not in known]

    def read(self, inputs: Inputs) -> Array | Mapping[str, Array]:
        """Return the observation.

        Raises:
            KeyError: The topics do not contain a term, or another number of its elements.
        """
        terms = self._terms(inputs)
        values = {name: self._value(name, inputs, terms) for name in self.widths}
        for name, (low, high) in self._bounds.items():
            values[name] = np.clip(values[name], low, high)
        flat = np.zeros(sum(self.widths[name] for name in self._manifest.terms), np.float32)
        for name, columns in self._manifest.terms.items():
            flat[columns] = values[name]
        if "" in self._manifest.observation:
            return flat
        parts: dict[str, Array] = {key: values[key].astype(np.float32) for key in self._keys}
        if "observation" in self._manifest.observation:
            parts["observation"] = flat
        return {**parts, **{key: inputs.images[key] for key in self._manifest.images}}

    def _terms(self, inputs: Inputs) -> dict[str, Array]:
        goal = inputs.goal
        if goal is None:
            goal = inputs.named.get("goal", inputs.named.get("desired_goal"))
        terms: dict[str, Array] = {name: getattr(inputs, name) for name in _JOINTS}
        if goal is not None:
            terms["goal"] = terms["desired_goal"] = goal
        if self._arm is not None and self.needs_tool:
            frames = self._arm.frames(inputs.joint_positions)
            tool, shoulder = frames[-1, :3, 3], frames[self._arm.first_moving, :3, :3]
            terms["tcp_position"] = terms["achieved_goal"] = tool
            if goal is not None and len(goal) == 3:
                terms["goal_offset"] = goal - tool
                terms["goal_from_shoulder"] = shoulder.T @ (goal - tool)
        return terms

    def _value(self, name: str, inputs: Inputs, terms: Mapping[str, Array]) -> Array:
        for value in (terms.get(name), inputs.named.get(name)):
            if value is not None and value.shape == (self.widths[name],):
                return value
        raise KeyError(name)
