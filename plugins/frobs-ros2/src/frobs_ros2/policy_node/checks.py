"""Compares a robot's topics with a bundle, and says what to change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from frobs_deploy import Bundle, Manifest
from frobs_ros2.policy_node.actions import CONTROLLERS, GRIPPERS, TOOLS
from frobs_ros2.policy_node.kinematics import Kinematics
from frobs_ros2.policy_node.observation import Inputs, Observer

_SAME = 1e-3  # relative


def bundle_problems(bundle: Bundle, laws: Sequence[Mapping[str, Any]], interface: str) -> Iterator[str]:
    """Say why a bundle cannot be used by a node, whatever the robot is like.

    Args:
        bundle: The bundle.
        laws: Laws of its controllers.
        interface: Type of the commands.
    """
    data = bundle.manifest
    if data["robot"] is None:
        yield "the policy was trained without a robot; use a policy for a robot"
        return
    if data["environment"]["wrappers"]:
        yield "the policy was trained with wrappers, which bundles do not contain; train it without them"
    controller = data.get("controller") or {}
    name, kinds = controller.get("name"), [law.get("law") for law in laws]
    if name not in CONTROLLERS:
        supported = ", ".join(CONTROLLERS)
        yield (
            f"the controller '{name}' is not supported by this node, which supports {supported}; use the policy with "
            "the simulator 'ros2' instead, for example: frobs evaluate ID --policy FILE --simulator ros2"
        )
        return
    if name in ("differential_drive", *TOOLS) and name not in kinds:
        yield (
            f"the bundle does not contain the numbers of its controller '{name}', as an earlier version wrote it; use "
            "'frobs ros2 run', which computes them, or write the bundle again: frobs export"
        )
        return
    if CONTROLLERS[name] != "position" and set(kinds) & {*GRIPPERS}:
        yield f"the policy commands a gripper beside '{name}', which this node does not support; use joint positions"
    if any(law.get("interpolate") for law in laws) and interface != "trajectory":
        yield "the controller interpolated between its commands in training; set --interface trajectory"
    joints = [str(joint["name"]) for joint in data["robot"]["joints"]]
    others = sorted({joint for law in laws for joint in law.get("joints", ())} - set(joints))
    if others:
        yield f"its controllers move the joints {', '.join(others)}, which its robot does not have; export it again"


def robot_problems(
    bundle: Bundle,
    manifest: Manifest,
    joint_names: Sequence[str],
    kinematics: Kinematics | None,
    observer: Observer,
    inputs: Inputs,
    rate: float | None,
) -> Iterator[str]:
    """Say how the robot differs from the robot in training.

    Args:
        bundle: The bundle.
        manifest: Its manifest.
        joint_names: Joints on the topic ``joint_states``.
        kinematics: Kinematics from the robot description, or None.
        observer: Observer of the bundle.
        inputs: The first inputs.
        rate: Measured rate of the joint states [Hz], or None if it was not measured.
    """
    missing = [name for name in manifest.joint_names if name not in joint_names]
    if missing:
        yield (
            f"joint_states does not contain the joints {', '.join(missing)}, but {', '.join(joint_names) or 'none'}; "
            "publish them, or rename them in the robot's driver"
        )
    timestep = manifest.control_timestep
    if timestep and rate is not None and rate * timestep < 0.9:
        yield (
            f"joint_states arrives at {rate:.0f} Hz, but the policy needs {1 / timestep:.0f} Hz; publish it faster, or "
            "train with a larger control_timestep"
        )
    needs_tool = observer.needs_tool or (bundle.manifest["controller"] or {}).get("name") in TOOLS
    if kinematics is None:
        if needs_tool:
            yield "the topic robot_description is missing, but the policy needs the tool's position; publish it"
    else:
        tcp = str(bundle.manifest["robot"]["tcp"])
        if needs_tool and not kinematics.has_link(tcp):
            yield f"the robot description has no link '{tcp}', which is the policy's tool center point; add it"
        for joint in bundle.manifest["robot"]["joints"]:
            yield from _limit_problems(joint, kinematics)
    if missing:
        return
    try:
        observation = observer.read(inputs)
    except KeyError as error:
        name = str(error.args[0])
        how = "set --goal, or publish the topic goal" if name in ("goal", "desired_goal", "goal_offset") else (
            f"publish the topic observation with the names {name}/0 to {name}/{observer.widths.get(name, 1) - 1}"
        )  # fmt: skip
        yield f"the observation term '{name}' is missing; {how}"
    except (ValueError, IndexError) as error:
        yield f"the observation cannot be assembled: {error}; publish the terms with the sizes {observer.widths}"
    else:
        parts = observation if isinstance(observation, Mapping) else {"": observation}
        for key, value in parts.items():
            space = manifest.observation[key]
            if value.shape != tuple(space.shape) or value.dtype != space.dtype:
                yield (
                    f"the observation '{key}' has the shape {value.shape} and type {value.dtype}, but the policy needs "
                    f"{tuple(space.shape)} and {space.dtype}; publish it in this form"
                )


def _limit_problems(joint: Mapping[str, Any], kinematics: Kinematics) -> Iterator[str]:
    name = str(joint["name"])
    if name not in kinematics.limits:
        return
    lower, upper, velocity, _ = kinematics.limits[name]
    trained_lower, trained_upper, trained_velocity, _ = trained_limits(joint)
    tolerance = _SAME * max(1.0, abs(trained_lower), abs(trained_upper)) if np.isfinite(trained_upper) else _SAME
    if lower > trained_lower + tolerance or upper < trained_upper - tolerance:
        yield (
            f"joint '{name}' may move in [{lower:g}, {upper:g}], but was trained in [{trained_lower:g}, "
            f"{trained_upper:g}]; train with these limits, or allow them on the robot"
        )
    if velocity < trained_velocity * (1.0 - _SAME):
        yield (
            f"joint '{name}' has the velocity limit {velocity:g}, but was trained with {trained_velocity:g}; train with "
            "this limit, or allow the trained one on the robot"
        )


def trained_limits(joint: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the lower and upper position limit, the velocity limit and the effort limit of a joint in a bundle."""
    missing = {"position_lower": -np.inf, "position_upper": np.inf, "velocity": np.inf, "effort": np.inf}
    return tuple(value if joint.get(key) is None else float(joint[key]) for key, value in missing.items())
