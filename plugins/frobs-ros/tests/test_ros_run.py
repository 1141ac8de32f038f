"""However a policy's run ends, the robot stops."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from frobs_ros.ros.processes import wait_for

# rospy's other thread sends each message a moment later, as on a busy machine
RUN = """
import sys, time
from frobs_ros.ros.environment import use_ros
use_ros()
from rospy.impl.tcpros_base import TCPROSTransport

write = TCPROSTransport.write_data

def write_later(self, data):
    time.sleep(0.1)
    write(self, data)

TCPROSTransport.write_data = write_later
from frobs_cli import main
main()
"""


@pytest.fixture
def speed(rosmaster: str) -> Any:
    """Returns the last measured speed of the base, in m/s and rad/s together."""
    import rospy
    from nav_msgs.msg import Odometry

    heard: list[float] = [0.0]

    def hear(message: Any) -> None:
        twist = message.twist.twist
        heard[0] = abs(twist.linear.x) + abs(twist.angular.z)

    topic = rospy.Subscriber("/odom", Odometry, hear, queue_size=1)
    yield lambda: heard[0]
    topic.unregister()


def _kill_node(process: subprocess.Popen[str]) -> None:
    from frobs_ros.errors import RosError
    from frobs_ros.ros import nodes

    (name,) = (name for name in nodes.names() if name.startswith("/frobs_policy"))
    with contextlib.suppress(RosError):  # the node may end before it answers
        nodes.shut_down(name)


@pytest.mark.slow
@pytest.mark.ros_feature("policies as nodes", "mujoco")
@pytest.mark.parametrize(
    ("end", "code"),
    [
        pytest.param(None, 0, id="seconds"),
        pytest.param(lambda process: process.send_signal(signal.SIGINT), 130, id="ctrl-c"),
        pytest.param(lambda process: process.send_signal(signal.SIGTERM), 130, id="sigterm"),
        pytest.param(_kill_node, 0, id="rosnode-kill"),
    ],
)
def test_a_robot_stops_when_the_run_ends(
    end: Callable[[subprocess.Popen[str]], None] | None,
    code: int,
    bridges: Callable[..., Any],
    speed: Callable[[], float],
) -> None:
    bridges("--robot", "kobuki")
    words = ["ros", "run", "frobs/KobukiDynamic-v0", "--pretrained", "--goal", "4", "0", "0", "--timeout", "30"]
    words += ["--seconds", "2"] if end is None else []
    with subprocess.Popen(
        [sys.executable, "-c", RUN, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert wait_for(lambda: speed() > 0.1 or process.poll() is not None, 120.0)
        assert process.poll() is None, process.communicate()[1]
        if end is not None:
            end(process)
        assert process.wait(60.0) == code, process.communicate()[1]
    assert wait_for(lambda: speed() < 0.01, 20.0)
