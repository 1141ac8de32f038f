"""The plugin libgazebo_ros_bumper.so, which publishes the parts that a link touches and the contact forces.

A message contains one state for each touched part: a link of a moving model, a shape of a static model, or the ground
plane. ``total_wrench`` contains the mean force on the sensor's link over the last physics steps, including friction, in
the world frame [N]. Simulators do not report individual contact points, so ``wrenches``, ``contact_positions``,
``contact_normals`` and ``depths`` are empty, and the torque is 0. All collision shapes of the link are included,
regardless of which shape the ``<contact>`` element names. As in gazebo_ros, ``frameName`` is copied into the message
header but does not rotate the force.
"""

from __future__ import annotations

from frobs_core.util.errors import check_name
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.gazebo_elements import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World
from frobs_ros.ros.names import resolve

_USUAL_RATE = 100.0  # default rate [Hz], whereas Gazebo publishes after each physics step by default


class BumperTopic(Component):
    """Publisher of a contact sensor's ``gazebo_msgs/ContactsState``.

    Args:
        space: Namespace of the topic: either empty or beginning with a slash.

    Raises:
        ConfigurationError: The plugin does not belong to a contact sensor.
        UnknownNameError: The model does not contain the sensor's link.
    """

    def __init__(self, model: Model, plugin: Plugin, space: str) -> None:
        sensor = plugin.owner('<sensor type="contact">', ("contact",))
        check_name(f"link of '{model.name}' for the plugin '{plugin.name}'", sensor.link, model.links)
        super().__init__(sensor.rate or _USUAL_RATE)
        self._key = model.name, sensor.link
        self._frame = plugin.text("frameName", default="world").strip("/")
        name = resolve(space, plugin.text("bumperTopicName", default="bumper_states"))
        self._publisher = self.publisher(name, "gazebo_msgs/ContactsState")

    def tell(self, world: World) -> None:
        simulation = world.simulation
        if simulation is None or self._publisher.get_num_connections() == 0:
            return
        from gazebo_msgs.msg import ContactState

        message = self._publisher.data_class(header=self.header(world, self._frame))
        for touch in world.touches[self._key]:
            if simulation.contact(touch.name)[0]:
                state = ContactState(collision1_name=touch.first, collision2_name=touch.second)
                force = state.total_wrench.force
                force.x, force.y, force.z = simulation.contact_resultant(touch.name)[0].tolist()
                message.states.append(state)
        self._publisher.publish(message)
