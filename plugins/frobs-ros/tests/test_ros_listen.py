"""``frobs ros serve --listen``, seen from another machine: two networks that a cable connects."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from frobs_ros.ros.environment import child_variables

SERVER, CLIENT = "10.77.0.1", "10.77.0.2"
ASK = """
from frobs_ros.ros.environment import use_ros

use_ros()
import rospy
from gazebo_msgs.srv import GetWorldProperties
from sensor_msgs.msg import JointState

rospy.init_node("far_away")
print("master", rospy.get_param("/use_sim_time"), flush=True)
answer = rospy.ServiceProxy("/gazebo/get_world_properties", GetWorldProperties)()
states = rospy.wait_for_message("/joint_states", JointState, 20.0)
print("bridge", answer.model_names, len(states.name), flush=True)
"""


class Machine:
    """A network of its own with one cable to the other machine.

    Args:
        address: Its address on the cable.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._keeper = subprocess.Popen(["unshare", "-n", "sleep", "600"])
        self._running: list[subprocess.Popen[str]] = []

    @property
    def pid(self) -> int:
        """A process in the network."""
        return self._keeper.pid

    def start(self, *command: object, **variables: str) -> subprocess.Popen[str]:
        """Start a program there that speaks to the master on the server."""
        environment = {key: value for key, value in child_variables().items() if key not in ("ROS_IP", "ROS_HOSTNAME")}
        process = subprocess.Popen(
            ["nsenter", "-t", str(self.pid), "-n", *map(str, command)],
            env={**environment, "ROS_MASTER_URI": f"http://{SERVER}:11311", "ROS_IP": self.address, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self._running.append(process)
        return process

    def run(self, *command: object) -> str:
        """Run a program there and return its output."""
        return self.start(*command).communicate(timeout=90.0)[0]

    def close(self) -> None:
        """End everything."""
        for process in self._running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
        self._keeper.kill()
        self._keeper.wait()


@pytest.fixture
def machines(ros: None) -> Iterator[tuple[Machine, Machine]]:
    """A server with a ROS master, and a client."""
    server, client = Machine(SERVER), Machine(CLIENT)
    try:
        until = time.monotonic() + 10.0
        own = os.readlink("/proc/self/ns/net")
        while any(os.readlink(f"/proc/{each.pid}/ns/net") == own for each in (server, client)):
            assert time.monotonic() < until
            time.sleep(0.01)
        cable = ["ip", "link", "add", "cable", "netns", str(server.pid), "type", "veth", "peer", "name", "cable"]
        subprocess.run([*cable, "netns", str(client.pid)], check=True)
        for each in (server, client):
            for words in ("addr add {}/24 dev cable", "link set cable up", "link set lo up"):
                assert each.run("ip", *words.format(each.address).split()) == ""
        server.start("rosmaster", "--core", "-p", "11311")
        yield server, client
    finally:
        server.close()
        client.close()


@pytest.fixture
def serve(machines: tuple[Machine, Machine], tmp_path: Path) -> Callable[..., str]:
    """Return what starts the bridge on the server with some options, and returns what the client sees of it."""
    server, client = machines

    def start(*options: str) -> str:
        command = [sys.executable, "-m", "frobs_ros.bridge", "--robot", "irb120", *options]
        bridge = server.start(*command, ROS_IP="", ROS_HOSTNAME="")
        assert bridge.stdout is not None
        for line in bridge.stdout:
            if "provides the services of Gazebo" in line:
                break
        assert bridge.poll() is None
        return client.run(sys.executable, "-c", ASK)

    return start


@pytest.mark.slow
@pytest.mark.ros_feature("clients on other machines", "mujoco")
def test_another_machine_reaches_the_bridge_with_listen(serve: Callable[..., str]) -> None:
    assert "bridge ['ground_plane', 'irb120'] 6" in serve("--listen", SERVER)


@pytest.mark.slow
@pytest.mark.ros_feature("closed to other machines", "mujoco")
def test_no_other_machine_reaches_the_bridge_without_listen(serve: Callable[..., str]) -> None:
    seen = serve()
    assert "master True" in seen  # the master of this test, which listens
    assert "unable to connect to service" in seen
