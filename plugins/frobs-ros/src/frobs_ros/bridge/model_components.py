"""Creation of a model's components: the controller manager and the plugins in the model file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from frobs_core.util.errors import check_name
from frobs_ros.bridge import LOG
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.controllers.manager import ControllerManager
from frobs_ros.bridge.controllers.types import TYPES
from frobs_ros.bridge.gazebo_elements import LIDARS, Plugin, read_plugins
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.plugins.cameras import CameraTopics
from frobs_ros.bridge.plugins.contacts import BumperTopic
from frobs_ros.bridge.plugins.depth import DepthTopics
from frobs_ros.bridge.plugins.differential_drive import make_diff_drive, make_kobuki
from frobs_ros.bridge.plugins.imu import ImuTopic
from frobs_ros.bridge.plugins.sensors import Scan, Truth
from frobs_ros.ros.names import resolve


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
            space = plugin.text("robotNamespace", plugin.text("ns", model.namespace)).strip("/")
            kind = PLUGINS.get(plugin.file)
            if kind is None:
                LOG.warning(
                    "model '%s': the plugin '%s' (lib%s.so) is ignored because the bridge does not support it",
                    model.name,
                    plugin.name,
                    plugin.file,
                )
            elif kind.need and not bridge.world.can(kind.need):
                LOG.warning(
                    "model '%s': the sensor '%s' publishes nothing, because the simulator does not support %s",
                    model.name,
                    plugin.sensor.name if plugin.sensor else plugin.name,
                    kind.need,
                )
            elif kind.on_static_models or not model.is_static:
                components.append(kind.make(bridge, model, plugin, f"/{space}" if space else ""))
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
    sensor = plugin.owner('<sensor type="ray">', LIDARS)
    name = resolve(space, plugin.text("topicName", default="scan"))
    frame = plugin.text("frameName", default=plugin.link).strip("/")
    return Scan(model, sensor.name, name, frame, plugin.number("gaussianNoise", default=0.0))


def _truth(bridge: Bridge, model: Model, plugin: Plugin, space: str) -> Component:
    link = plugin.text("bodyName")
    check_name(f"link of '{model.name}' for the plugin '{plugin.name}'", link, model.links)
    name = resolve(space, plugin.text("topicName", default="ground_truth"))
    return Truth(
        model, link, name, plugin.text("frameName", default="world"), plugin.number("updateRate", default=100.0)
    )


class PluginKind(NamedTuple):
    """A plugin that the bridge supports.

    Attributes:
        make: Function that creates the component from the bridge, the model, the plugin and the namespace.
        need: Simulator capability that the plugin's sensor requires, or an empty string.
        on_static_models: Whether the plugin also supports static models.
    """

    make: Callable[[Bridge, Model, Plugin, str], Component]
    need: str = ""
    on_static_models: bool = False


def _sensor_kind(make: Callable[..., Component], need: str = "", **options: float) -> PluginKind:
    return PluginKind(lambda _, model, plugin, space: make(model, plugin, space, **options), need, True)


PLUGINS = {
    "gazebo_ros_control": PluginKind(lambda bridge, model, _, space: add_manager(bridge, model, space)),
    "gazebo_ros_diff_drive": PluginKind(make_diff_drive),
    "gazebo_ros_kobuki": PluginKind(make_kobuki),
    "gazebo_ros_joint_state_publisher": PluginKind(_joint_states),
    "gazebo_ros_laser": PluginKind(_scan, "rays"),
    "gazebo_ros_gpu_laser": PluginKind(_scan, "rays"),
    "gazebo_ros_p3d": PluginKind(_truth),
    "gazebo_ros_camera": _sensor_kind(CameraTopics, "cameras"),
    "gazebo_ros_depth_camera": _sensor_kind(DepthTopics, "cameras"),
    "gazebo_ros_openni_kinect": _sensor_kind(DepthTopics, "cameras", most=5.0),
    "gazebo_ros_imu": _sensor_kind(ImuTopic),
    "gazebo_ros_imu_sensor": _sensor_kind(ImuTopic),
    "gazebo_ros_bumper": _sensor_kind(BumperTopic, "contacts"),
}
"""Supported plugins, by library name."""
