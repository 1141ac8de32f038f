"""Measures the time from a joint state to the command of a policy node."""

import os
import signal
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from ros2_processes import Start

from frobs_core.plugins.registry import pretrained_path
from frobs_deploy import read_bundle
from frobs_deploy.bundle import pack_bundle
from frobs_ros2.serve.measurements import robot_description

ID = "frobs/Irb120Reach-v0"
RATE = 200.0
"""Rate of the joint states, and of the policy [Hz]."""


def served_arm(folder: Path) -> tuple[object, ...]:
    """Write the description of the robot of :data:`ID`, and return the options of the nodes that play this robot."""
    with closing(gym.make(f"frobs_core:{ID}", disable_env_checker=True).unwrapped) as env:
        env.reset(seed=0)
        robot: Any = env.robot  # type: ignore[attr-defined]
        file = folder / "robot.urdf"
        file.write_text(robot_description(robot), "utf-8")
        return ("--description", file, "--names", *robot.joint_names, "--home", *robot.home[0].tolist())


def measure_loopback(start: Start, folder: Path, cycles: int, with_policy: bool = True) -> dict[str, Any]:
    """Send joint states to another process at 200 Hz, and measure when its commands arrive.

    Args:
        start: Function that starts processes.
        folder: Folder for the robot's description and the bundle.
        cycles: Number of joint states.
        with_policy: Whether the other process is a policy node, or else a bare node of rclpy that answers at once.

    Returns:
        ``sent`` and ``arrived``, numbers of messages; ``median`` and ``late``, the median and 99th percentile of the round
        trip [ms]; and ``cpu``, the processor time of the other process per cycle, with that of its start [ms].
    """
    if with_policy:
        bundle = read_bundle(pretrained_path(ID))
        file = folder / "fast.frobs"
        manifest = {**bundle.manifest, "control_timestep": 1.0 / RATE}
        file.write_bytes(pack_bundle(manifest, bundle.graph, bundle.license))
        options = ("--goal", 0.3, 0.1, 0.5, "--slow-start", 0, "--max-age", 5)
        other = start("-m", "frobs_ros2.policy_node", file, *options)
    else:
        other = start("node", "fast_arm.py", "--echo")
    result = start("node", "fast_arm.py", "--rate", RATE, "--cycles", cycles, *served_arm(folder)).result()
    fields = Path(f"/proc/{other.process.pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    other.process.send_signal(signal.SIGINT)
    other.process.wait(30.0)
    trips = np.array(result.pop("milliseconds")) if result["arrived"] else np.array([np.inf])
    median, late = float(np.median(trips)), float(np.quantile(trips, 0.99))
    return {**result, "median": median, "late": late, "cpu": 1e3 * seconds / cycles}
