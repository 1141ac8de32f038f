"""libgazebo_ros_bumper.so: the parts that a link touches, and the force on the link.

A message has one state for each link, or shape of a static model, that is touched, and for the ground plane. ``total_wrench``
holds the mean force on the sensor's link over the last physics steps, friction included [N], in the axes of the world. Simulators
report no single contact points, so ``wrenches``, ``contact_positions``, ``contact_normals`` and ``depths`` are empty, and
the torque is 0. All collisions of the link count, whichever the ``<contact>`` element names. As in gazebo_ros,
``frameName`` is written into the header and turns nothing.
"""

from __future__ import annotations

from frobs_core.errors import UnknownNameError
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.extras import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.plugins.drive import topic
from frobs_ros.bridge.world import World
from frobs_ros.errors import GazeboElementError

_USUAL_RATE = 100.0  # [Hz] of a sensor without a rate; Gazebo would publish in each physics step


class BumperTopic(Component):
    """``gazebo_msgs/ContactsState`` of a contact sensor.

    Args:
        space: Namespace of its topic; empty, or begins with a slash.

    Raises:
        ConfigurationError: The plugin is in no contact sensor, or the model has no such link.
    """

    def __init__(self, model: Model, plugin: Plugin, space: str) -> None:
        import rospy
        from gazebo_msgs.msg import ContactsState

        if plugin.sensor is None or plugin.sensor.kind != "contact":
            raise GazeboElementError(f"the plugin '{plugin.name}'", 'must be in a <sensor type="contact">.')
        if plugin.sensor.link not in model.links:
            what = f"link of '{model.name}' for the plugin '{plugin.name}'"
            raise UnknownNameError(what, plugin.sensor.link, model.links)
        super().__init__(plugin.sensor.rate or _USUAL_RATE)
        self._key = model.name, plugin.sensor.link
        self._frame = plugin.text("frameName", default="world").strip("/")
        name = topic(space, plugin.text("bumperTopicName", default="bumper_states"))
        self._publisher = self.own(rospy.Publisher(name, ContactsState, queue_size=1, tcp_nodelay=True))

    def tell(self, world: World) -> None:
        """Publish, if there are subscribers."""
        simulation = world.simulation
        if simulation is None or self._publisher.get_num_connections() == 0:
            return
        from gazebo_msgs.msg import ContactState

        message = self._publisher.data_class()
        message.header.frame_id, message.header.stamp = self._frame, self.next_stamp(world)
        for touch in world.touches[self._key]:
            if simulation.contact(touch.name)[0]:
                state = ContactState(collision1_name=touch.first, collision2_name=touch.second)
                force = state.total_wrench.force
                force.x, force.y, force.z = simulation.contact_resultant(touch.name)[0].tolist()
                message.states.append(state)
        self._publisher.publish(message)
