"""The bridge's ROS node, including its startup and shutdown."""

from __future__ import annotations

import logging
import os
import socket
import sys
from typing import TYPE_CHECKING
from urllib.parse import urlparse

from frobs_core import plugins
from frobs_core.plugins.capabilities import check_capabilities
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.errors import ConfigurationError
from frobs_ros.bridge import LOG
from frobs_ros.bridge.bridge import Bridge
from frobs_ros.bridge.world import World

if TYPE_CHECKING:
    from frobs_ros.cli.serve import ServeOptions


def serve(options: ServeOptions) -> None:
    """Run a simulation with Gazebo's interface until the node is shut down.

    Raises:
        MasterError: No ROS master responds.
        FrobsError: An option, the robot or the world is invalid, or ROS or the simulator is unavailable.
    """
    _bind(options.listen)
    from frobs_ros.ros import master
    from frobs_ros.ros.environment import use_ros

    use_ros()
    import rospy

    _log(options.verbose)
    master.require()
    bridge = open_bridge(options)
    rospy.on_shutdown(bridge.close)  # close the bridge before rospy closes the topics
    try:
        rospy.spin()
    finally:
        bridge.close()


def open_bridge(options: ServeOptions) -> Bridge:
    """Start the node in this process and return its bridge, which the caller must close. See :func:`serve`."""
    import rosgraph
    import rospy

    from frobs_ros.bridge.initial_world import add_models, read_robot, set_up_robot
    from frobs_ros.bridge.model_components import make_components
    from frobs_ros.bridge.publishers import Clock, StateCommands, States
    from frobs_ros.bridge.sdf import WorldFile, read_world
    from frobs_ros.bridge.services import joints, links, models
    from frobs_ros.bridge.services import world as world_services
    from frobs_ros.bridge.services.offer import Offers

    # Check for errors before creating the node, which replaces any running node of the same name.
    record = plugins.get_record("simulator", options.simulator)
    assert isinstance(record, SimulatorRecord)
    check_capabilities(record.name, record.capabilities, {"the bridge": {"teleport": Level.APPROXIMATE}})
    file = WorldFile(floor=True) if options.world is None else read_world(options.world)
    timestep = file.timestep if options.timestep is None else options.timestep
    world = World(record, timestep=timestep, gravity=file.gravity, floor=file.floor)
    robot = read_robot(options.robot, options.model_name, options.namespace) if options.robot else None
    _check_alone()
    # Python must switch quickly between rospy's threads: the default interval of 5 ms would delay every call.
    sys.setswitchinterval(0.0002)
    # Set use_sim_time before creating the node, so that the node's own stamps also use simulated time. If the other
    # parameter is not set, rospy queries the master for it with each log message.
    master = rosgraph.Master("/gazebo")
    for name, usual in (("/use_sim_time", True), ("/rosout_disable_topics_generation", False)):
        if not master.hasParam(name):
            master.setParam(name, usual)
    rospy.init_node("gazebo")
    bridge = Bridge(world, paused=options.paused, make_components=make_components)
    rate = options.max_update_rate
    bridge.max_update_rate = file.max_update_rate if rate is None else rate
    try:
        bridge.join(Clock(options.clock_frequency))
        bridge.join(States(options.state_frequency))
        bridge.join(StateCommands(bridge))
        if options.gui:
            world.open_viewer()
        add_models(bridge, file)
        if robot is not None:
            set_up_robot(bridge, *robot)
        bridge.loop.start()
        world_services.set_defaults(bridge, file.lights or ["sun"])
        # Clients wait until the services of the world exist, so these services are registered last.
        Offers(bridge, "/gazebo").offer(
            {**models.SERVICES, **links.SERVICES, **joints.SERVICES, **world_services.SERVICES}
        )
        bridge.call(bridge.tell)
    except BaseException:
        bridge.close()
        raise
    LOG.info("%s provides the services of Gazebo", record.name)
    return bridge


def _check_alone() -> None:
    """Raise an error if Gazebo or another bridge is running, because this node would shut down the other node."""
    import rosgraph

    try:
        uri = rosgraph.Master("/frobs").lookupNode("/gazebo")
    except rosgraph.MasterException:
        return
    address = urlparse(uri)
    try:
        with socket.create_connection((address.hostname or "", address.port or 0), timeout=2.0):
            raise ConfigurationError(
                f"Gazebo or another bridge is already running as the ROS node /gazebo ({uri}); stop that process first."
            )
    except OSError:  # the other node has ended without unregistering
        return


def _log(verbose: bool) -> None:
    """Write the bridge's log to stderr."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("[%(levelname)s] %(message)s"))
    LOG.addHandler(handler)
    LOG.setLevel(logging.DEBUG if verbose else logging.INFO)
    LOG.propagate = False
    logging.getLogger("rosout").addFilter(OnlyOnce())


class OnlyOnce(logging.Filter):
    """Filter that logs a lost connection to the ROS master only once, instead of once per topic and service."""

    said = False

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to log a record."""
        if "registrations are now out of sync" not in str(record.msg):
            return True
        self.said, before = True, self.said
        return not before


def _bind(listen: str | None) -> None:
    """Configure the address on which rospy listens. Call this function before importing rospy."""
    os.environ["ROS_IP"] = listen or "127.0.0.1"
    os.environ.pop("ROS_HOSTNAME", None)
