"""Measure one policy on every simulator and through ROS topics, and what an environment step costs there.

Writes ``docs/explanation/ros-measured.md``; needs ROS 1 and Gazebo 11 (``frobs doctor ros``), and some minutes::

    python tests/benchmarks/ros.py
"""

from __future__ import annotations

import os
import socket
import sys
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter
from typing import Any

import gymnasium as gym
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from tasks import ROOT, current_commit, frobs, machine

from frobs_core.deploy import Policy
from frobs_core.parity import measure_parity
from frobs_core.pretrained import read_pretrained

PAGE = ROOT / "docs" / "explanation" / "ros-measured.md"
ID, ROBOT = "frobs/Irb120Reach-v0", "irb120"
SIMULATORS = ("mujoco", "pybullet", "gazebo")
RESPONSES = ("step_response", "saturated_step_response")
EPISODE = 50
"""Control steps of one."""
SUBSTEPS = 10
GAZEBO_BUDGET, BRIDGE_BUDGET = 300.0, 100.0
"""Environment steps per second, of 10 physics steps each."""
SPEED = 2.0
"""Simulated seconds per second of the bridge while a policy acts through it."""


def success_on(simulator: str, episodes: int) -> dict[str, Any]:
    """Evaluate the policy that comes with the ID on a simulator."""
    return frobs("evaluate", ID, "--pretrained", "--simulator", simulator, "--episodes", episodes)


@contextmanager
def bridge() -> Iterator[None]:
    """A master of our own, and the bridge with the robot; this process is a node of it."""
    from frobs_ros import master, processes
    from frobs_ros.environment import use_ros
    from frobs_ros.services import wait_for

    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{found.getsockname()[1]}"
    use_ros()
    import rospy

    master.ensure()
    command = [sys.executable, "-m", "frobs_ros.bridge", "--robot", ROBOT, "--max-update-rate", str(SPEED * 1000.0)]
    processes.start("bridge", command, name="bridge")
    try:
        rospy.init_node("measurement", anonymous=True, disable_signals=True)
        wait_for("/gazebo/pause_physics", 60.0)
        yield
    finally:
        rospy.signal_shutdown("measured")
        processes.stop(processes.owned())


def success_through_topics(episodes: int) -> dict[str, Any]:
    """Let the policy act on the bridge's robot through ROS, from the places and to the goals of an evaluation's kind.

    Returns:
        ``episodes``, ``success_rate``, and ``late``, the share of steps that came late.
    """
    from gazebo_msgs.srv import SetModelConfiguration
    from std_srvs.srv import Empty

    from frobs_ros.mirror import Command, Mirror
    from frobs_ros.policy_loop import act
    from frobs_ros.ros_robot import RosRobot
    from frobs_ros.services import call

    bundle = read_pretrained(ID)
    mirror, policy = Mirror(bundle), Policy(bundle)
    env = gym.make(f"frobs_core:{ID}", disable_env_checker=True).unwrapped
    robot = RosRobot(mirror, controller="arm_controller")
    names, period = list(mirror.joint_names), mirror.env.control_timestep
    done = steps = late = 0
    for episode in range(episodes):
        env.reset(seed=1_000_000 + episode)
        start, goal = env.robot.joint_positions[0].copy(), env.task.goal[0].copy()
        call("/gazebo/pause_physics", Empty)
        call("/gazebo/set_model_configuration", SetModelConfiguration, ROBOT, "", names, start.tolist())
        robot.send(Command(env.robot.command_mode, start), period)
        call("/gazebo/unpause_physics", Empty)
        while (state := robot.state()) is None or not np.allclose(state.positions, start, atol=0.02):
            pass
        report = act(robot, mirror, policy, goal=goal, timeout=5.0, seconds=EPISODE * period)
        done, steps, late = done + report.is_success, steps + report.steps, late + report.late
    env.close()
    mirror.close()
    return {"episodes": episodes, "success_rate": done / episodes, "late": late / max(steps, 1)}


def responses() -> list[dict[str, Any]]:
    """Compare how the joints follow steps on each simulator with how they do on the first."""
    others = SIMULATORS[1:]
    certificate = measure_parity(ID, SIMULATORS, only=RESPONSES)
    return [
        {"title": m.title, "simulator": c.simulator, "quantity": c.quantity, "error": c.error, "unit": c.unit}
        for m in certificate.measurements
        for c in m.comparisons
        if c.simulator in others
    ]


def gazebo_speed(steps: int) -> dict[str, float]:
    """Return environment steps per second on Gazebo: a command, ten physics steps, joint and tool states."""
    env = gym.make(f"frobs_core:{ID}", disable_env_checker=True, simulator="gazebo").unwrapped
    env.reset(seed=0)
    home = env.robot.joint_positions.copy()

    def step() -> None:
        env.robot.command(home)
        env.simulation.step(SUBSTEPS)
        env.robot.joint_positions.sum()
        env.robot.frame_pose("tcp")

    found = timed(step, steps)
    env.close()
    return found


def bridge_speeds(steps: int) -> dict[str, dict[str, float]]:
    """Return what an environment step through ROS costs, and each of its parts; the world is paused."""
    import rospy
    from gazebo_msgs.srv import GetJointProperties, GetLinkState
    from std_msgs.msg import Float64MultiArray
    from std_srvs.srv import Empty

    from frobs_msgs.srv import StepWorld
    from frobs_ros.services import call

    call("/gazebo/pause_physics", Empty)
    publisher = rospy.Publisher("/joint_group_position_controller/command", Float64MultiArray, queue_size=1)
    message = Float64MultiArray(data=[0.0] * 6)
    parts: dict[str, Callable[[], Any]] = {
        "a command on a topic": lambda: publisher.publish(message),
        f"{SUBSTEPS} physics steps by the service": lambda: call("/gazebo/step", StepWorld, SUBSTEPS),
        "a link's state by the service": lambda: call("/gazebo/get_link_state", GetLinkState, "tool0", "world"),
        "a joint's state by the service": lambda: call("/gazebo/get_joint_properties", GetJointProperties, "joint_1"),
        "unpausing and pausing": lambda: (call("/gazebo/unpause_physics", Empty), call("/gazebo/pause_physics", Empty)),
    }
    first_three = list(parts.values())[:3]
    whole = {"an environment step: the first three": lambda: [part() for part in first_three]}
    return {name: timed(part, steps) for name, part in (whole | parts).items()}


def timed(function: Callable[[], Any], times: int) -> dict[str, float]:
    """Return ``rate`` [1/s] of a function, and ``median`` and ``late`` [s], in which 95 % of the calls are done."""
    for _ in range(20):
        function()
    seen = []
    for _ in range(times):
        start = perf_counter()
        function()
        seen.append(perf_counter() - start)
    return {"rate": len(seen) / sum(seen), "median": median(seen), "late": quantiles(seen, n=20)[-1]}


def report(
    success: Mapping[str, Mapping[str, Any]],
    topics: Mapping[str, Any],
    differences: Sequence[Mapping[str, Any]],
    gazebo: Mapping[str, float],
    parts: Mapping[str, Mapping[str, float]],
) -> str:
    """Return the page.

    Args:
        success: By simulator, what :func:`success_on` found.
        topics: What :func:`success_through_topics` found.
        differences: What :func:`responses` found.
        gazebo: What :func:`gazebo_speed` found.
        parts: What :func:`bridge_speeds` found.
    """
    lines = [
        "# ROS and Gazebo, measured",
        "",
        f"By `tests/benchmarks/ros.py`, {date.today():%d %B %Y}, on {machine()}, at commit {current_commit()}.",
        "",
        "## One policy everywhere",
        "",
        f"The policy that comes with `{ID}`, which learned on MuJoCo, unchanged. Through ROS topics it acts on the bridge over "
        f"MuJoCo by `frobs ros run`'s way: joint states in, trajectories out, while the time goes {SPEED:g} times as fast as "
        f"real; {topics['late']:.1%} of its steps came late.",
        "",
        "| where | episodes | success |",
        "|---|---:|---:|",
        *(f"| {name} | {row['episodes']} | {row['success_rate']:.1%} |" for name, row in success.items()),
        f"| ROS topics, on the bridge | {topics['episodes']} | {topics['success_rate']:.1%} |",
        "",
        "## How joints respond",
        "",
        f"Largest differences from {SIMULATORS[0]}, by `frobs parity {ID}`.",
        "",
        "| measurement | simulator | what differs | by |",
        "|---|---|---|---:|",
        *(
            f"| {row['title']} | {row['simulator']} | {row['quantity']} | {row['error']:.2g} {row['unit']} |"
            for row in differences
        ),
        "",
        "## What a step costs",
        "",
        f"One environment, {SUBSTEPS} physics steps in each of its steps. FRobs_RL's logs show 3 to 4 steps per second.",
        "",
        "| what | per second | median | 95 % within |",
        "|---|---:|---:|---:|",
    ]
    rows = {"an environment step on real Gazebo": (gazebo, GAZEBO_BUDGET)}
    rows |= {
        f"the bridge: {name}": (row, BRIDGE_BUDGET if n == 0 else 0.0) for n, (name, row) in enumerate(parts.items())
    }
    for name, (row, budget) in rows.items():
        wanted = f" (≥ {budget:g}{'' if row['rate'] >= budget else ': missed'})" if budget else ""
        lines.append(
            f"| {name} | {row['rate']:,.0f}{wanted} | {1e3 * row['median']:.2f} ms | {1e3 * row['late']:.2f} ms |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=200, help="on each simulator")
    parser.add_argument("--topics", type=int, default=100, help="episodes through ROS topics")
    parser.add_argument("--steps", type=int, default=1000, help="of which the time is taken")
    given = parser.parse_args()
    success = {name: success_on(name, given.episodes) for name in SIMULATORS}
    differences, gazebo = responses(), gazebo_speed(given.steps)
    with bridge():
        topics, parts = success_through_topics(given.topics), bridge_speeds(given.steps)
    PAGE.write_text(report(success, topics, differences, gazebo, parts), "utf-8")


if __name__ == "__main__":
    main()
