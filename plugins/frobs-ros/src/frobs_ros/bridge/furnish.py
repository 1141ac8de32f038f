"""What a model brings with it: its controller manager, and the plugins that its file asks for."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.controllers.manager import ControllerManager
from frobs_ros.bridge.extras import read_plugins
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.part import Part

LOG = logging.getLogger("frobs.bridge")


def furnish(bridge: Bridge, model: Model) -> Sequence[Part]:
    """Make the parts of a model that has just come; in the loop's thread.

    Raises:
        ConfigurationError: A plugin has impossible parameters.
    """
    parts: list[Part] = []
    for plugin in read_plugins(model.description.elements):
        space = plugin.text("robotNamespace", "ns", default=model.namespace).strip("/")
        space = f"/{space}" if space else ""
        if plugin.file == "gazebo_ros_control":
            parts.append(_manager(bridge, model, space))
        else:
            LOG.warning(
                "model '%s': the plugin '%s' (lib%s.so) is none that the bridge knows; it is left out",
                model.name,
                plugin.name,
                plugin.file,
            )
    return parts


def _manager(bridge: Bridge, model: Model, space: str) -> ControllerManager:
    import rospy

    manager = ControllerManager(bridge, model, space, lambda name: rospy.get_param(name, None))
    manager.offer()
    return manager
