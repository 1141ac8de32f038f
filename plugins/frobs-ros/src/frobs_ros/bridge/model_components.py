"""Creation of a model's components: the controller manager and the plugins in the model file."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any

from frobs_core.util.errors import check_name
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.controllers.manager import ControllerManager
from frobs_ros.bridge.controllers.types import TYPES
from frobs_ros.bridge.gazebo_elements import LIDARS, Plugin, read_plugins
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.plugins.cameras import CameraTopics
from frobs_ros.bridge.plugins.contacts import BumperTopic
from frobs_ros.bridge.plugins.depth import DepthTopics
from frobs_ros.bridge.plugins.differential_drive import DrivePlugin, read_diff_drive, read_kobuki, topic
from frobs_ros.bridge.plugins.imu import ImuTopic, read_imu, read_imu_sensor
from frobs_ros.bridge.plugins.sensors import Scan, Truth
from frobs_ros.errors import GazeboElementError

LOG = logging.getLogger("frobs.bridge")


def make_components(bridge: Bridge, model: Model) -> Sequence[Component]:
    """Create the components of a new model.

    Call this function from the simulation thread, or before the thread starts.

    Raises:
        ConfigurationError: A plugin has invalid parameters.
        UnknownNameError: A plugin refers to an unknown joint or link.
    """
    components: list[Component] = []
    try:
        for plugin in read_plugins(model.description.elements):
            space = plugin.text("robotNamespace", "ns", default=model.namespace).strip("/")
            make = PLUGINS.get(plugin.file)
            if make is None:
                LOG.warning(
                    "model '%s': the plugin '%s' (lib%s.so) is ignored because the bridge does not support it",
                    model.name,
                    plugin.name,
                    plugin.file,
                )
            elif (need := _NEEDS.get(plugin.file)) and not bridge.world.can(need):
                LOG.warning(
                    "model '%s': the sensor '%s' publishes nothing, because the simulator does not support %s",
                    model.name,
                    plugin.sensor.name if plugin.sensor else plugin.name,
                    need,
                )
            elif plugin.file in _ON_STATIC_MODELS or not model.is_static:
                components.append(make(bridge, model, plugin, f"/{space}" if space else ""))
    except BaseException:
        for component in components:
            component.close()
        raise
    return components


def add_manager(bridge: Bridge, model: Model, space: str) -> ControllerManager:
    """Create a controller manager for a model and register the manager's services.

    The namespace ``space`` must be empty or begin with a slash.
    """
    import rospy

    manager = ControllerManager(bridge, model, space, lambda name: rospy.get_param(name, None))
    manager.offer()
    return manager


def _joint_states(bridge: Bridge, model: Model, plugin: Plugin, space: str) -> Component:
    names = plugin.text("jointName").replace(",", " ").split()
    for name in names:
        check_name(f"joint of '{model.name}' for the plugin '{plugin.name}'", name, model.joints)
    parameters: dict[str, Any] = {"publish_rate": plugin.number("updateRate", default=100.0)}
    make = TYPES["joint_state_controller/JointStateController"]
    return make(model, f"{space}/{plugin.name}", {**parameters, "joints": names} if names else parameters)


def _scan(bridge: Bridge, model: Model, plugin: Plugin, space: str) -> Component:
    if plugin.sensor is None or plugin.sensor.kind not in LIDARS:
        raise GazeboElementError(f"the plugin '{plugin.name}'", 'the plugin must be inside a <sensor type="ray">.')
    return Scan(
        model,
        plugin.sensor.name,
        topic(space, plugin.text("topicName", default="scan")),
        plugin.text("frameName", default=plugin.link).strip("/"),
        plugin.number("gaussianNoise", default=0.0),
    )


def _truth(bridge: Bridge, model: Model, plugin: Plugin, space: str) -> Component:
    link = plugin.text("bodyName")
    check_name(f"link of '{model.name}' for the plugin '{plugin.name}'", link, model.links)
    name = topic(space, plugin.text("topicName", default="ground_truth"))
    return Truth(
        model, link, name, plugin.text("frameName", default="world"), plugin.number("updateRate", default=100.0)
    )


PLUGINS: dict[str, Callable[[Bridge, Model, Plugin, str], Component]] = {
    "gazebo_ros_control": lambda bridge, model, plugin, space: add_manager(bridge, model, space),
    "gazebo_ros_diff_drive": lambda bridge, model, plugin, space: DrivePlugin(
        bridge.world, model, *read_diff_drive(plugin, model, space)
    ),
    "gazebo_ros_kobuki": lambda bridge, model, plugin, space: DrivePlugin(
        bridge.world, model, *read_kobuki(plugin, model, space)
    ),
    "gazebo_ros_joint_state_publisher": _joint_states,
    "gazebo_ros_laser": _scan,
    "gazebo_ros_gpu_laser": _scan,
    "gazebo_ros_p3d": _truth,
    "gazebo_ros_camera": lambda bridge, model, plugin, space: CameraTopics(model, plugin, space),
    "gazebo_ros_depth_camera": lambda bridge, model, plugin, space: DepthTopics(model, plugin, space),
    "gazebo_ros_openni_kinect": lambda bridge, model, plugin, space: DepthTopics(model, plugin, space, most=5.0),
    "gazebo_ros_imu": lambda bridge, model, plugin, space: ImuTopic(*read_imu(plugin, model, space)),
    "gazebo_ros_imu_sensor": lambda bridge, model, plugin, space: ImuTopic(*read_imu_sensor(plugin, model, space)),
    "gazebo_ros_bumper": lambda bridge, model, plugin, space: BumperTopic(model, plugin, space),
}
"""Functions that create a component from the bridge, the model, the plugin and the namespace, by library name."""

_NEEDS = {
    "gazebo_ros_laser": "rays",
    "gazebo_ros_gpu_laser": "rays",
    "gazebo_ros_camera": "cameras",
    "gazebo_ros_depth_camera": "cameras",
    "gazebo_ros_openni_kinect": "cameras",
    "gazebo_ros_bumper": "contacts",
}
"""Simulator capability that each plugin's sensor requires."""

_ON_STATIC_MODELS = {name for name, need in _NEEDS.items() if need != "rays"} | {
    "gazebo_ros_imu",
    "gazebo_ros_imu_sensor",
}
"""Plugins that also support static models."""
