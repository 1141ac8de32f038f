"""A session of a user who has said nothing of addresses: no process of it can be reached from outside this machine."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from ipaddress import ip_address
from pathlib import Path

import pytest

from frobs_ros.ros.guard import descendants

PACKAGES = Path(__file__).parent / "packages"
FUNCTIONS = """
from frobs_rl_compat.ros import ros_gazebo, ros_launch, ros_node, ros_spawn
from frobs_ros.ros.environment import use_ros
from frobs_rl_compat.ros.logged_errors import or_raise

or_raise(ros_gazebo.launch_Gazebo)(gui=False, launch_new_term=False)  # and a master, as there is none
or_raise(ros_spawn.spawn_model_in_gazebo)(
    "tiny_arm", "arm.urdf.xacro", "controllers.yaml", ["joint_state_controller", "arm_controller"], ns="/arm"
)
or_raise(ros_launch.ros_launch_from_pkg)("tiny_arm", "talk.launch", launch_new_term=False)
or_raise(ros_node.ros_node_from_pkg)("tiny_arm", "talk.py", name="speaker", launch_new_term=False)
use_ros()
import rospy
rospy.init_node("session", disable_signals=True)
"""
COMMANDS = """
import sys
from frobs_ros.ros import master, nodes, processes
from frobs_ros.ros.services import is_offered

master.ensure()
frobs = [sys.executable, "-m", "frobs_cli", "ros"]
bridge = processes.start("gazebo", [*frobs, "serve", "--robot", "irb120"], name="serve")
bridge.wait_until(lambda: is_offered("/gazebo/get_world_properties"), 120.0)
words = ["run", "frobs/Irb120Reach-v0", "--pretrained", "--controller", "arm_controller"]
policy = processes.start("node", [*frobs, *words], name="run")
policy.wait_until(lambda: any("frobs_policy" in name for name in nodes.names()), 120.0)
"""
WAIT = """
import sys
print("ready", flush=True)
sys.stdin.read()
"""


def words_of(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/cmdline").read_text().split("\0")


def is_walled_off(pid: int) -> bool:
    """Return whether a process is on a network of its own that holds the loopback interface alone."""
    interfaces = Path(f"/proc/{pid}/net/dev").read_text().splitlines()[2:]
    own = os.readlink(f"/proc/{pid}/ns/net") != os.readlink("/proc/self/ns/net")
    return own and [row.partition(":")[0].strip() for row in interfaces] == ["lo"]


@pytest.fixture
def session(lonely: str, tmp_path: Path) -> Iterator[Callable[..., list[int]]]:
    """Runs a script as a user who has said nothing of addresses; returns all processes that came of it."""
    unsaid = ("ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE", "DISPLAY", "GAZEBO_IP", "FROBS_GAZEBO_NETWORK")
    variables = {key: value for key, value in os.environ.items() if key not in unsaid}
    variables |= {"ROS_MASTER_URI": lonely.replace("127.0.0.1", "localhost"), "ROS_PACKAGE_PATH": str(PACKAGES)}
    variables["FROBS_ROS_TIMEOUT"] = "20"
    running: list[subprocess.Popen[bytes]] = []
    log = tmp_path / "log"

    def run(script: str, **more: str) -> list[int]:
        with log.open("wb") as file:
            process = subprocess.Popen(
                [sys.executable, "-c", script + WAIT],
                env=variables | more,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=file,
            )
        running.append(process)
        assert process.stdout is not None
        while (line := process.stdout.readline()) != b"ready\n":
            assert line, log.read_text()
        return [process.pid, *descendants(process.pid)]

    yield run
    for process in running:
        process.communicate(timeout=60.0)


def assert_only_loopback(pids: list[int], listening: Callable[[int], set[str]], words: list[str]) -> None:
    """Check where processes listen, and that those which words of their command lines tell of do listen."""
    addresses = {pid: listening(pid) for pid in pids}
    reachable = {
        " ".join(words_of(pid)): found
        for pid, found in addresses.items()
        if not is_walled_off(pid) and not all(ip_address(address).is_loopback for address in found)
    }
    assert reachable == {}
    for word in words:
        found = [pid for pid in pids if any(word in each.split("/") for each in words_of(pid))]
        assert any(addresses[pid] for pid in found), f"'{word}' does not listen: {list(map(words_of, pids))}"


@pytest.mark.slow
@pytest.mark.ros_feature("closed to other machines", "ros", "mujoco", "gazebo")
def test_what_functions_start_listens_on_the_loopback_address_alone(
    session: Callable[..., list[int]], listening: Callable[[int], set[str]], simulator: str
) -> None:
    pids = session(FUNCTIONS, FROBS_ROS_BACKEND=f"bridge:{simulator}")
    words = [
        "-c",
        "rosmaster",
        "frobs_ros.bridge",
        "frobs_ros.ros.state_publisher",
        "roslaunch",
        "talk.py",
        "__name:=speaker",
    ]
    assert_only_loopback(pids, listening, words + ["gzserver"] * (simulator == "gazebo"))


@pytest.mark.slow
@pytest.mark.ros_feature("closed to other machines", "ros", "mujoco")
def test_what_commands_start_listens_on_the_loopback_address_alone(
    session: Callable[..., list[int]], listening: Callable[[int], set[str]]
) -> None:
    assert_only_loopback(session(COMMANDS), listening, ["rosmaster", "serve", "run"])


def test_a_process_that_listens_on_every_interface_is_noticed(
    session: Callable[..., list[int]], listening: Callable[[int], set[str]]
) -> None:
    pids = session("import socket\nkept = socket.create_server(('', 0))\n")
    with pytest.raises(AssertionError, match=r"0\.0\.0\.0"):
        assert_only_loopback(pids, listening, [])
