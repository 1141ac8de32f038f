"""Services for joints."""

from __future__ import annotations

import math
from typing import Any

from frobs_core.models import JointType
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.forces import JointEffort
from frobs_ros.bridge.services.links import times
from frobs_ros.bridge.services.offer import Offers, done, failed

_TYPES = {JointType.REVOLUTE: 0, JointType.CONTINUOUS: 1, JointType.PRISMATIC: 2}
_OTHERS = ("hiStop", "loStop", "erp", "cfm", "stop_erp", "stop_cfm", "fudge_factor", "fmax", "vel")


def offer_joint_services(offers: Offers) -> None:
    """Provide the services for joints."""
    from gazebo_msgs.srv import ApplyJointEffort, GetJointProperties, JointRequest, SetJointProperties

    bridge = offers.bridge
    offers.offer("get_joint_properties", GetJointProperties, lambda request: _get_properties(bridge, request))
    offers.offer("set_joint_properties", SetJointProperties, lambda request: _set_properties(bridge, request))
    offers.offer("apply_joint_effort", ApplyJointEffort, lambda request: _apply(bridge, request))
    # Gazebo provides this service under both names.
    offers.offer("clear_joint_forces", JointRequest, lambda request: _clear(bridge, request))
    offers.offer("clear_joint_efforts", JointRequest, lambda request: _clear(bridge, request))


def _get_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    try:
        model, name = bridge.world.find_joint(request.joint_name)
    except UnknownNameError as error:
        return failed(f"GetJointProperties: joint not found. {error}")
    robot, simulation = model.robot, bridge.world.simulation
    assert robot is not None
    assert simulation is not None
    column = model.joints[name]
    joint = robot.model.actuated_joints[column]
    return done(
        "GetJointProperties: got properties",
        type=_TYPES[joint.type],
        damping=[float(simulation.parameter("joint_damping", model.key)[0, column])],
        position=[float(robot.joint_positions[0, column])],
        rate=[float(robot.joint_velocities[0, column])],
    )


def _set_properties(bridge: Bridge, request: Any) -> dict[str, Any]:
    try:
        model, name = bridge.world.find_joint(request.joint_name)
    except UnknownNameError as error:
        return failed(f"SetJointProperties: joint not found. {error}")
    given = request.ode_joint_config
    others = [field for field in _OTHERS if getattr(given, field)]
    if others or not given.damping:
        return failed(
            "SetJointProperties: nothing was set. Only damping can be changed, but the request contains "
            f"{', '.join(others) or 'no damping'}"
        )
    if not (math.isfinite(given.damping[0]) and given.damping[0] >= 0.0):
        return failed(f"SetJointProperties: the damping is {given.damping[0]}; it must be at least 0")
    assert bridge.world.simulation is not None
    values = bridge.world.simulation.parameter("joint_damping", model.key).copy()
    values[0, model.joints[name]] = given.damping[0]
    bridge.world.write_parameter("joint_damping", model.key, values)
    return done("SetJointProperties: properties set")


def _apply(bridge: Bridge, request: Any) -> dict[str, Any]:
    try:
        model, joint = bridge.world.find_joint(request.joint_name)
    except UnknownNameError as error:
        return failed(f"ApplyJointEffort: joint not found. {error}")
    if not math.isfinite(request.effort):
        raise ConfigurationError(f"the effort is {request.effort}; it must be finite.")
    bridge.world.forces.add(JointEffort(model.name, joint, request.effort, *times(bridge, request)))
    return done("ApplyJointEffort: effort set")


def _clear(bridge: Bridge, request: Any) -> None:
    model, joint = bridge.world.find_joint(request.joint_name)
    bridge.world.forces.clear_joint(model.name, joint)
