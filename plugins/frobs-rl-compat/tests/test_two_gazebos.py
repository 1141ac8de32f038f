"""Two programs on one machine, each with a master and a simulation of its own: they do not meet."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

# Launches a simulation, lets a ball fall that many steps, and does what it is told, line by line.
PROGRAM = """
import sys
from frobs_ros.ros.environment import use_ros
use_ros()
import rospy
from gazebo_msgs.srv import GetModelState, GetWorldProperties, SpawnModel
from geometry_msgs.msg import Pose
from frobs_msgs.srv import StepWorld
from frobs_rl_compat.ros import ros_node
from frobs_rl_compat.gazebo.launch import close_Gazebo, launch_Gazebo
from frobs_rl_compat.ros.logged_errors import or_raise
from frobs_ros.ros.services import call

MASS = "<inertial><mass>1</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>"
BALL = f"<sdf version='1.6'><model name='ball'><link name='link'>{MASS}</link></model></sdf>"
own, height = sys.argv[1], float(sys.argv[2])
or_raise(launch_Gazebo)(paused=True, gui=False, output="log", launch_new_term=False)
place = Pose()
place.position.z, place.orientation.w = height, 1.0
for name in ("ball", own):
    assert call("/gazebo/spawn_sdf_model", SpawnModel, name, BALL.replace("ball", name), "", place, "world").success
print("ready", flush=True)
for line in sys.stdin:
    word, _, steps = line.strip().partition(" ")
    if word == "step":
        time = call("/gazebo/step", StepWorld, int(steps)).time
        z = call("/gazebo/get_model_state", GetModelState, "ball", "world").pose.position.z
        names = sorted(set(call("/gazebo/get_world_properties", GetWorldProperties).model_names) - {"ground_plane"})
        print(f"{time:.3f} {z:.4f} {' '.join(names)}", flush=True)
    elif word == "end":
        print(ros_node.ros_kill_all_processes(), flush=True)
"""


class Program:
    """One of the two."""

    def __init__(self, own: str, height: float, backend: str) -> None:
        with socket.socket() as found:
            found.bind(("127.0.0.1", 0))
            uri = f"http://127.0.0.1:{found.getsockname()[1]}"
        given = {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "FROBS_ROS_BACKEND": backend}
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, own, str(height)],
            env={**os.environ, **given},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def hear(self) -> str:
        """Return the next line that it says."""
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def tell(self, line: str) -> str:
        """Tell it what to do, and return what it says to it."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        return self.hear()


@pytest.fixture
def programs(ros: None, simulator: str) -> Iterator[Callable[..., Program]]:
    """Starts programs, and ends those that are left."""
    running: list[Program] = []

    def start(own: str, height: float) -> Program:
        running.append(Program(own, height, f"bridge:{simulator}"))
        return running[-1]

    yield start
    for program in running:
        with program.process as process:
            process.kill()


def fallen(height: float, steps: int) -> float:
    """Return where a ball is that falls for so many milliseconds, semi-implicitly."""
    return height - 9.8 * 1e-6 * steps * (steps + 1) / 2.0


@pytest.mark.slow
@pytest.mark.ros_feature("several masters on one machine", "mujoco", "gazebo")
def test_two_simulations_with_masters_of_their_own_do_not_meet(programs: Callable[..., Program]) -> None:
    first, second = programs("one", 10.0), programs("two", 20.0)
    assert first.hear() == second.hear() == "ready"
    for program, own, height, steps in ((first, "one", 10.0, 100), (second, "two", 20.0, 200)):
        time, z, *names = program.tell(f"step {steps}").split()
        assert float(time) == pytest.approx(steps * 1e-3)
        assert float(z) == pytest.approx(fallen(height, steps), abs=2e-3)
        assert names == sorted(["ball", own])
    assert first.tell("end") == "True"
    assert second.tell("step 100").split()[0] == "0.300"
    second.process.kill()


@pytest.mark.slow
@pytest.mark.ros_feature("several masters on one machine", "mujoco", "gazebo")
def test_a_simulation_goes_on_when_the_other_program_is_killed(programs: Callable[..., Program]) -> None:
    first, second = programs("one", 10.0), programs("two", 20.0)
    assert first.hear() == second.hear() == "ready"
    first.process.kill()
    first.process.wait()
    time, z, *_ = second.tell("step 100").split()
    assert float(time) == pytest.approx(0.1)
    assert float(z) == pytest.approx(fallen(20.0, 100), abs=2e-3)
