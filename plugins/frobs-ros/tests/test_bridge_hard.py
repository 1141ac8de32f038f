"""The bridge where things go wrong: clients that vanish, no master, models that come and go without end."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import pytest

CYCLES = int(os.environ.get("FROBS_BRIDGE_CYCLES", "60"))
"""Of spawning and deleting; 10000 where there is time."""

WARM_UP = 20
BOX = (
    '<robot name="box"><link name="b"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" '
    'iyz="0"/></inertial><collision><geometry><box size=".2 .2 .2"/></geometry></collision></link></robot>'
)
SLIDER = """<robot name="slider"><link name="world"/><link name="l"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="prismatic"><axis xyz="1 0 0"/><parent link="world"/><child link="l"/><limit lower="-1" upper="1" effort="9" velocity="1"/></joint>
<transmission name="t"><joint name="j"><hardwareInterface>hardware_interface/PositionJointInterface</hardwareInterface></joint></transmission>
<gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo></robot>"""
STEPPING = """
from frobs_ros.ros.environment import use_ros
use_ros()
import rospy
from frobs_msgs.srv import StepWorld
rospy.ServiceProxy("/gazebo/step", StepWorld)(200000)
"""
LISTENING = """
from frobs_ros.ros.environment import use_ros
use_ros()
import rospy
from rosgraph_msgs.msg import Clock
from gazebo_msgs.msg import ModelStates
rospy.init_node("listener", anonymous=True)
heard = []
rospy.Subscriber("/clock", Clock, lambda m: print("heard", flush=True) if not heard else None)
rospy.Subscriber("/gazebo/model_states", ModelStates, lambda m: None)
rospy.spin()
"""


def proxy(name: str, kind: Any) -> Any:
    import rospy

    return rospy.ServiceProxy(name, kind)


def step(steps: int) -> float:
    from frobs_msgs.srv import StepWorld

    return float(proxy("/gazebo/step", StepWorld)(steps).time)


@pytest.fixture(scope="module")
def bridge(bridges: Callable[..., Any]) -> Any:
    return bridges("--paused")


@pytest.mark.ros_feature("closed to other machines", "mujoco")
def test_only_the_loopback_address_is_listened_at(bridge: Any, listening: Callable[[int], set[str]]) -> None:
    assert listening(bridge.process.pid) == {"127.0.0.1"}


def test_no_master_is_one_clear_line(ros: None) -> None:
    environment = {**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:9"}
    done = subprocess.run(
        [sys.executable, "-m", "frobs_ros.bridge"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "127.0.0.1:9" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--simulator", "mojoco"], "mujoco"),
        (["--robot", "irb12"], "irb120"),
        (["--timestep", "-1"], "time step"),
        (["--world", "/nowhere.world"], "nowhere.world"),
        ([], "another bridge"),
    ],
    ids=["simulator", "robot", "timestep", "world", "second"],
)
def test_impossible_start_is_one_clear_line_and_ends_nobody(bridge: Any, arguments: list[str], words: str) -> None:
    command = [sys.executable, "-m", "frobs_ros.bridge", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert step(1) > 0.0


@pytest.mark.slow
def test_client_that_is_killed_while_it_waits_harms_nobody(bridge: Any) -> None:
    before = step(1)
    client = subprocess.Popen([sys.executable, "-c", STEPPING])
    deadline = time.monotonic() + 30.0
    time.sleep(2.0)
    client.send_signal(signal.SIGKILL)
    client.wait()
    assert step(1) > before
    assert time.monotonic() < deadline + 60.0


@pytest.mark.slow
def test_listener_that_hangs_or_vanishes_harms_nobody(bridge: Any) -> None:
    listeners = [subprocess.Popen([sys.executable, "-c", LISTENING], stdout=subprocess.PIPE) for _ in range(2)]
    try:
        step(100)
        for listener in listeners:
            assert listener.stdout is not None
            assert listener.stdout.readline() == b"heard\n"  # the clock is latched
        listeners[0].send_signal(signal.SIGSTOP)
        listeners[1].send_signal(signal.SIGKILL)
        began = time.monotonic()
        before = step(1)
        assert step(20000) == pytest.approx(before + 20.0)
        assert time.monotonic() - began < 60.0
    finally:
        for listener in listeners:
            listener.kill()
            listener.wait()
            assert listener.stdout is not None
            listener.stdout.close()


def test_torn_requests_harm_nobody(bridge: Any) -> None:
    import rosgraph

    address = urlparse(rosgraph.Master("/client").lookupService("/gazebo/step"))
    header = b"".join(
        struct.pack("<I", len(field)) + field
        for field in (b"callerid=/torn", b"md5sum=*", b"service=/gazebo/step", b"persistent=1")
    )
    for torn in (b"", b"\xff" * 3, struct.pack("<I", len(header)) + header + struct.pack("<I", 4) + b"\x01"):
        with socket.create_connection((address.hostname, address.port or 0)) as connection:
            connection.sendall(torn)
    assert step(1) > 0.0


@pytest.mark.slow
def test_models_come_and_go_without_a_leak(bridge: Any) -> None:
    import rosgraph
    from gazebo_msgs.srv import DeleteModel, SpawnModel
    from geometry_msgs.msg import Pose

    spawn, delete = proxy("/gazebo/spawn_urdf_model", SpawnModel), proxy("/gazebo/delete_model", DeleteModel)
    master = rosgraph.Master("/client")

    def use() -> tuple[int, int, int, int]:
        """Return threads, open files, memory [kB] and what the bridge has registered."""
        status = Path(f"/proc/{bridge.process.pid}/status").read_text()
        number = {line.partition(":")[0]: line.split()[1] for line in status.splitlines() if len(line.split()) > 1}
        files = len(list(Path(f"/proc/{bridge.process.pid}/fd").iterdir()))
        registered = sum("/gazebo" in nodes for kind in master.getSystemState() for _, nodes in kind)
        return int(number["Threads"]), files, int(number["VmRSS"]), registered

    for cycle in range(WARM_UP + CYCLES):
        xml = SLIDER if cycle % 2 else BOX
        assert spawn("guest", xml, "/guest", Pose(), "").success
        assert delete("guest").success
        if cycle == WARM_UP - 1:
            time.sleep(1.0)
            before = use()
    time.sleep(1.0)
    after = use()
    assert after[0] <= before[0] + 2
    assert after[1] <= before[1] + 4
    assert after[2] <= before[2] + 20_000 + 2 * CYCLES
    assert after[3] == before[3]


@pytest.mark.ros_feature("the command gz", "mujoco")
def test_gz_steps_pauses_and_resets_and_waits(bridge: Any) -> None:
    from gazebo_msgs.srv import GetPhysicsProperties, GetWorldProperties

    def gz(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "frobs_ros.bridge.gz", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert gz("world", "-r").returncode == 0
    assert gz("world", "-m", "250").returncode == 0
    world = proxy("/gazebo/get_world_properties", GetWorldProperties)
    assert world().sim_time == pytest.approx(0.25)
    assert gz("world", "-s").returncode == 0
    assert world().sim_time == pytest.approx(0.251)
    physics = proxy("/gazebo/get_physics_properties", GetPhysicsProperties)
    assert gz("world", "-p", "0").returncode == 0
    assert not physics().pause
    assert gz("world", "-p", "1").returncode == 0
    assert physics().pause
    before = world().sim_time
    assert gz("world", "-o").returncode == 0
    assert world().sim_time == before
    assert gz("world", "-m", "-3").returncode == 2


def test_gz_without_a_bridge_hands_over_or_says_so(tmp_path: Path) -> None:
    environment = {**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:9", "PATH": str(tmp_path)}
    command = [sys.executable, "-m", "frobs_ros.bridge.gz", "world", "-s"]
    alone = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert alone.returncode == 1
    assert "frobs ros serve" in alone.stderr
    other = tmp_path / "gz"
    other.write_text(f"#!{shutil.which('sh')}\necho other $*\n")
    other.chmod(0o755)
    handed = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (handed.returncode, handed.stdout) == (0, "other world -s\n")
