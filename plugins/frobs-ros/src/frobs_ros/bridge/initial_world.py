"""Functions that add models to the initial world and set up a robot's ROS interfaces as a launch file would."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from frobs_core.description import Robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_ros.bridge import LOG
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.controllers.manager import ControllerManager
from frobs_ros.bridge.differential_drive import DriveSettings
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.model_components import add_manager
from frobs_ros.bridge.plugins.differential_drive import DrivePlugin
from frobs_ros.bridge.plugins.sensors import Scan
from frobs_ros.bridge.poses import WORLD
from frobs_ros.bridge.sdf import WorldFile
from frobs_ros.bridge.transforms import Transforms
from frobs_ros.bridge.urdf import describe_robot, with_file_uris

STATES, TRAJECTORY, GROUP = "joint_state_controller", "arm_controller", "joint_group_position_controller"
"""Names of the default controllers of a robot whose file contains no transmissions."""


def read_robot(robot: str, name: str, namespace: str) -> tuple[Model, Robot]:
    """Return a model of a robot at the world's origin, and the robot's description.

    ``robot`` is the name of an installed robot or the path of a model file.

    Raises:
        UnknownNameError: The robot does not exist.
        ModelFileError: The model file is invalid.
    """
    description = RobotConfig(robot=robot).describe()
    return Model(name or description.name, namespace.strip("/"), describe_robot(description), WORLD), description


def set_up_robot(bridge: Bridge, model: Model, description: Robot) -> None:
    """Add a robot to the world, with the ROS interfaces that clients expect.

    Call this function from the simulation thread, or before the thread starts.

    The parameter ``robot_description`` is set to the robot's URDF. If the robot's file contains no transmissions, the
    robot gets a controller manager: ``joint_state_controller`` publishes joint states, ``arm_controller`` follows
    trajectories, and ``joint_group_position_controller`` is loaded but not started. The robot's frames are published on
    ``/tf`` and ``/tf_static``. A wheeled robot subscribes to ``cmd_vel`` and publishes ``odom``. A single lidar
    publishes on ``scan``. If a robot has several lidars, each lidar publishes on a topic that is named after the lidar.

    Raises:
        FrobsError: The simulator rejects the robot.
    """
    import rospy

    prefix = f"/{model.namespace}" if model.namespace else ""
    file = model.placement().model
    if file.format == "urdf":
        rospy.set_param(f"{prefix}/robot_description", with_file_uris(file.xml))
    else:
        LOG.warning("robot_description is not set, because '%s' has an MJCF file, which ROS cannot read", model.name)
    bridge.add(model)
    bridge.extend(model.name, _components(bridge, model, description, prefix))


def add_models(bridge: Bridge, file: WorldFile) -> None:
    """Add the models of a world file to the world.

    Call this function from the simulation thread, or before the thread starts.

    Raises:
        FrobsError: The simulator rejects a model.
    """
    for name, (description, place) in file.models.items():
        bridge.add(Model(name, "", description, place))


def _components(bridge: Bridge, model: Model, robot: Robot, prefix: str) -> Sequence[Component]:
    file = model.placement().model
    components: list[Component] = []
    if file.format == "urdf":
        components.append(Transforms(model, file.xml))
    wheels: tuple[str, ...] = ()
    drive = robot.differential_drive
    if drive is not None:
        wheels = drive.left + drive.right
        settings = DriveSettings(
            wheels=drive,
            command=f"{prefix}/cmd_vel",
            odom=f"{prefix}/odom",
            frame="odom",
            child=file.root,
            stiff=robot.gains is None,
        )
        components.append(DrivePlugin(bridge.world, model, settings))
    for name, lidar in robot.lidars.items():
        components.append(Scan(model, name, f"{prefix}/{'scan' if len(robot.lidars) == 1 else name}", lidar.frame))
    if not model.description.has_transmissions:
        components.append(_controllers(bridge, model, prefix, [joint for joint in model.joints if joint not in wheels]))
    return components


def _controllers(bridge: Bridge, model: Model, prefix: str, joints: list[str]) -> ControllerManager:
    import rospy

    controllers: dict[str, dict[str, Any]] = {
        STATES: {"type": "joint_state_controller/JointStateController", "publish_rate": 100},
        TRAJECTORY: {
            "type": "position_controllers/JointTrajectoryController",
            "joints": joints,
            "constraints": {"goal_time": 1.0, **{joint: {"goal": 0.05} for joint in joints}},
        },
        GROUP: {"type": "position_controllers/JointGroupPositionController", "joints": joints},
    }
    manager = add_manager(bridge, model, prefix)
    for name, parameters in controllers.items():
        if name == STATES or joints:
            if not rospy.has_param(f"{prefix}/{name}/type"):
                rospy.set_param(f"{prefix}/{name}", parameters)
            manager.load(name)
    manager.switch([STATES, *([TRAJECTORY] if joints else [])], [], strict=True)
    return manager
