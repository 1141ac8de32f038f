"""Services for joints."""

from __future__ import annotations

import math
from typing import Any

from frobs_core.models import JointType
from frobs_core.util.errors import ConfigurationError
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.forces import JointEffort
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.services.links import times
from frobs_ros.bridge.services.offer import Services, done, found

_TYPES = {JointType.REVOLUTE: 0, JointType.CONTINUOUS: 1, JointType.PRISMATIC: 2}
_OTHERS = ("hiStop", "loStop", "erp", "cfm", "stop_erp", "stop_cfm", "fudge_factor", "fmax", "vel")


def _joint(bridge: Bridge, request: Any) -> tuple[Model, str]:
    return found(bridge.world.find_joint, request.joint_name, "joint not found.", explain=True)


def _get_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    model, name = _joint(bridge, request)
    robot, column = model.handle, model.joints[name]
    joint = robot.model.actuated_joints[column]
    return done(
        "GetJointProperties: got properties",
        type=_TYPES[joint.type],
        damping=[float(bridge.world.parameter("joint_damping", model.key)[0, column])],
        position=[float(robot.joint_positions[0, column])],
        rate=[float(robot.joint_velocities[0, column])],
    )


def _set_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    model, name = _joint(bridge, request)
    given = request.ode_joint_config
    others = [field for field in _OTHERS if getattr(given, field)]
    if others or not given.damping:
        raise ConfigurationError(
            "nothing was set. Only damping can be changed, but the request contains "
            f"{', '.join(others) or 'no damping'}"
        )
    if not (math.isfinite(given.damping[0]) and given.damping[0] >= 0.0):
        raise ConfigurationError(f"the damping is {given.damping[0]}; it must be at least 0")
    values = bridge.world.parameter("joint_damping", model.key).copy()
    values[0, model.joints[name]] = given.damping[0]
    bridge.world.write_parameter("joint_damping", model.key, values)
    return done("SetJointProperties: properties set")


def _apply(bridge: Bridge, request: Any) -> dict[str, Any]:
    model, joint = _joint(bridge, request)
    if not math.isfinite(request.effort):
        raise ConfigurationError(f"the effort is {request.effort}; it must be finite.")
    bridge.world.forces.add(JointEffort(model.name, joint, *times(bridge, request), request.effort))
    return done("ApplyJointEffort: effort set")


def _clear(bridge: Bridge, request: Any) -> None:
    model, joint = bridge.world.find_joint(request.joint_name)
    bridge.world.forces.remove(model.name, joint, JointEffort)


SERVICES: Services = {
    "get_joint_properties": ("GetJointProperties", _get_properties),
    "set_joint_properties": ("SetJointProperties", _set_properties),
    "apply_joint_effort": ("ApplyJointEffort", _apply),
    # Gazebo provides this service under both names.
    "clear_joint_forces": ("JointRequest", _clear),
    "clear_joint_efforts": ("JointRequest", _clear),
}
