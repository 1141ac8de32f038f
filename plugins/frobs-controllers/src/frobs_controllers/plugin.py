"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import ControllerRecord, Level

_SUMMARIES = {
    "joint_position": "actions are joint positions, scaled to the limits",
    "joint_delta_position": "actions change the commanded joint positions by up to one step",
    "joint_velocity": "actions are joint velocities, scaled to the limits",
    "joint_effort": "actions are joint efforts, scaled to the limits",
    "tcp_delta_position": "actions move the tool center point by up to one step",
    "tcp_delta_pose": "actions move and rotate the tool center point by up to one step",
    "differential_drive": "actions are the linear and angular velocity of a wheeled base",
    "tcp_impedance": "actions move the equilibrium of a spring that pulls the tool; runs at the physics rate",
    "gripper_position": "an action sets the opening of a gripper",
    "gripper_delta": "an action changes the opening of a gripper by up to one step",
    "gripper_binary": "an action opens or closes a gripper, depending on its sign",
    "discrete": "a Discrete action selects one move of another controller",
}

_MODULES = dict.fromkeys(("gripper_position", "gripper_delta", "gripper_binary"), "gripper")


@hookimpl
def frobs_controllers() -> list[ControllerRecord]:
    """Return the records of the controllers."""
    return [
        ControllerRecord(
            name=name,
            summary=summary,
            entry_point=f"frobs_controllers.{_MODULES.get(name, name)}:{name.title().replace('_', '')}",
            install_hint="pip install frobs-controllers",
            needs={"drive": Level.APPROXIMATE},
        )
        for name, summary in _SUMMARIES.items()
    ]
