"""Measure one policy on every simulator and through ROS topics, and the duration of an environment step there.

Writes ``docs/explanation/ros-measured.md``. Requires ROS 1 and Gazebo 11 (``frobs doctor ros``), an idle machine, and
about five minutes::

    python tests/benchmarks/ros.py
    python tests/benchmarks/ros.py --gazebo-speed    # half a minute; writes nothing
"""

from __future__ import annotations

import os
import socket
import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter, thread_time
from typing import Any

import gymnasium as gym
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from common import ROOT, current_commit, frobs, machine

from frobs_deploy import Policy
from frobs_devkit.parity import measure_parity
from frobs_train.evaluation.evaluate import wilson_interval
from frobs_train.export.pretrained import read_pretrained

PAGE = ROOT / "docs" / "explanation" / "ros-measured.md"
ID, ROBOT = "frobs/Irb120Reach-v0", "irb120"
SIMULATORS = ("mujoco", "pybullet", "gazebo")
RESPONSES = ("step_response", "saturated_step_response")
EPISODE = 50
"""Control steps per episode."""
SUBSTEPS = 10
WARM_UP = 20
"""Number of calls before the timed ones."""
GAZEBO_BUDGET, BRIDGE_BUDGET = 300.0, 100.0
"""Minimum environment steps per second, of 10 physics steps each: on Gazebo, and through ROS."""
TOPICS = "ROS topics, on the bridge"
GROUP, TRAJECTORY = "joint_group_position_controller", "arm_controller"
PHYSICS_TIMESTEP = 0.001
"""Physics timestep of the bridge [s]."""
JUMP, SAMPLES = 0.2, 100
"""Jump of each joint's command through ROS topics [rad], and number of control steps that are recorded."""
SPEED = 2.0
"""Simulated seconds per second of the bridge while a policy acts through it."""


def success_on(simulator: str, episodes: int) -> dict[str, Any]:
    """Evaluate the ID's trained policy on a simulator."""
    return frobs("evaluate", ID, "--pretrained", "--simulator", simulator, "--episodes", episodes)


@contextmanager
def bridge() -> Iterator[None]:
    """Run a separate ROS master and the bridge with the robot; this process is a node."""
    from frobs_ros.ros import master, processes
    from frobs_ros.ros.environment import use_ros
    from frobs_ros.ros.services import wait_for

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
    """Let the policy control the bridge's robot through ROS, with initial states and goals as in an evaluation.

    Returns:
        ``episodes``, ``success_rate``, ``success_interval``, and ``late``, the share of steps that missed their
        deadline.
    """
    import rospy
    from gazebo_msgs.srv import SetModelConfiguration
    from std_srvs.srv import Empty

    from frobs_ros.policy_node.running import act, make_env
    from frobs_ros.ros.services import call

    bundle = read_pretrained(ID)
    policy, real = Policy(bundle), make_env(bundle, controller="arm_controller", timeout=5.0)
    env = gym.make(f"frobs_core:{ID}", disable_env_checker=True).unwrapped
    robot, names = real.robot, list(real.robot.joint_names)
    done = steps = late = 0
    for episode in range(episodes):
        env.reset(seed=1_000_000 + episode)
        start, goal = env.robot.joint_positions[0].copy(), env.task.goal[0].copy()
        call("/gazebo/pause_physics", Empty)
        call("/gazebo/set_model_configuration", SetModelConfiguration, ROBOT, "", names, start.tolist())
        call("/gazebo/unpause_physics", Empty)
        real.simulation.reset()
        while not np.allclose(robot.joint_positions[0], start, atol=0.02):
            robot.command(start[None])
            real.simulation.step(real.decimation)
        report = act(real, policy, clock=rospy.get_time, goal=goal, seconds=EPISODE * real.control_timestep)
        done, steps, late = done + report.is_success, steps + report.steps, late + report.late
    env.close()
    real.close()
    return {
        "episodes": episodes,
        "success_rate": done / episodes,
        "success_interval": wilson_interval(done, episodes),
        "late": late / max(steps, 1),
    }


def responses() -> list[dict[str, Any]]:
    """Compare the step responses of the joints on each simulator with those on the first one."""
    others = SIMULATORS[1:]
    certificate = measure_parity(ID, SIMULATORS, only=RESPONSES)
    return [
        {
            "title": m.title,
            "simulator": c.simulator,
            "quantity": c.quantity,
            "error": c.error,
            "allowed": c.tolerance,
            "unit": c.unit,
            "where": c.where,
        }
        for m in certificate.measurements
        for c in m.comparisons
        if c.simulator in others
    ]


class Joints:
    """The bridge's arm through ROS: position commands on a topic, steps by the service, joint states from a topic.

    Simulated time must be paused. The constructor stops the trajectory controller, and starts the position controller.
    """

    def __init__(self) -> None:
        import rospy
        from controller_manager_msgs.srv import SwitchController
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray
        from std_srvs.srv import Empty

        from frobs_msgs.srv import StepWorld
        from frobs_ros.ros.services import call

        call("/gazebo/pause_physics", Empty)
        switched = call("/controller_manager/switch_controller", SwitchController, [GROUP], [TRAJECTORY], 2, False, 3.0)
        assert switched.ok
        self.names = list(rospy.get_param(f"/{GROUP}/joints"))
        self._message, self._heard = Float64MultiArray, None
        self._publisher = rospy.Publisher(f"/{GROUP}/command", Float64MultiArray, queue_size=1, tcp_nodelay=True)
        self._subscriber = rospy.Subscriber("/joint_states", JointState, self._hear, queue_size=1, tcp_nodelay=True)
        self._step = lambda: call("/gazebo/step", StepWorld, SUBSTEPS)
        # Joint states are published at integer multiples of their period. Align these with the ends of control steps.
        passed = round(call("/gazebo/step", StepWorld, 1).time / PHYSICS_TIMESTEP)
        call("/gazebo/step", StepWorld, SUBSTEPS - passed % SUBSTEPS)
        while self._publisher.get_num_connections() == 0 or self._subscriber.get_num_connections() == 0:
            time.sleep(0.01)

    def _hear(self, message: Any) -> None:
        self._heard = message

    def command(self, positions: Sequence[float]) -> None:
        """Send positions [rad], in the order of :attr:`names`."""
        self._publisher.publish(self._message(data=positions))

    def step(self) -> None:
        """Take the physics steps of one control step; they are complete on return."""
        self._heard = None
        self._step()

    def states(self) -> list[float]:
        """Wait for the joint states after the last step, and return the positions [rad]."""
        end = perf_counter() + 10.0
        while (heard := self._heard) is None:
            assert perf_counter() < end, "no joint states come"
        found = dict(zip(heard.name, heard.position, strict=True))
        return [found[name] for name in self.names]


def bridge_response(joints: Joints) -> dict[str, Any]:
    """Compare the step responses of the joints through ROS topics with those without ROS."""
    env = gym.make(
        f"frobs_core:{ID}",
        disable_env_checker=True,
        physics_timestep=PHYSICS_TIMESTEP,
        control_timestep=SUBSTEPS * PHYSICS_TIMESTEP,
    ).unwrapped
    env.reset(seed=0)
    home = env.robot.home[0]
    order = [env.robot.joint_names.index(name) for name in joints.names]
    worst, where = 0.0, ""
    for j, name in enumerate(env.robot.joint_names):
        target = home.copy()
        target[j] += JUMP if env.robot.position_upper[0, j] - home[j] > 2.0 * JUMP else -JUMP
        traces = np.zeros((2, SAMPLES, len(home)))
        env.robot.write_joint_state(home[None])
        env.robot.command(home[None])
        _put_home(joints, env.robot.joint_names, home, home[order])
        env.robot.command(target[None])
        joints.command(target[order].tolist())
        time.sleep(0.1)  # let the command arrive
        for k in range(SAMPLES):
            env.simulation.step(SUBSTEPS)
            traces[0, k] = env.robot.joint_positions[0]
            joints.step()
            traces[1, k, order] = joints.states()
        off = np.abs(traces[0] - traces[1])
        if off.max() > worst:
            worst, where = float(off.max()), f"jump of {name}"
    env.close()
    return {
        "title": "Step response",
        "simulator": TOPICS,
        "quantity": "joint positions",
        "error": worst,
        "allowed": None,
        "unit": "rad",
        "where": where,
    }


def _put_home(joints: Joints, names: Sequence[str], home: Any, ordered: Any) -> None:
    from gazebo_msgs.srv import SetModelConfiguration

    from frobs_ros.ros.services import call

    joints.command(ordered.tolist())
    time.sleep(0.1)
    joints.step()  # make the controller use the command before the joints are set
    joints.states()
    call("/gazebo/set_model_configuration", SetModelConfiguration, ROBOT, "", list(names), home.tolist())


def gazebo_speeds(steps: int) -> tuple[dict[str, dict[str, float]], dict[str, float]]:
    """Return the durations of an environment step on Gazebo and of its parts.

    Returns:
        The durations by name, as returned by :func:`timed`; and the processor time per environment step [s] of
        Gazebo's physics thread and of this thread. The two take turns, so their sum is the duration of a step without
        other load.
    """
    env = gym.make(f"frobs_core:{ID}", simulator="gazebo", physics_timestep=0.002, control_timestep=SUBSTEPS * 0.002)
    env.reset(seed=0)
    env.action_space.seed(0)
    inner = env.unwrapped

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()

    pid = inner.simulation.native[0].process.pid
    before, mine = _thread_seconds(pid), thread_time()
    found = {"an environment step": timed(step, steps)}
    after, calls = _thread_seconds(pid), steps + WARM_UP
    processor = {
        "Gazebo's physics thread": max(after[task] - before[task] for task in before) / calls,
        "Python": (thread_time() - mine) / calls,
    }
    found[f"{SUBSTEPS} physics steps: request, physics, answer"] = timed(lambda: inner.simulation.step(SUBSTEPS), steps)
    from frobs_sim_gazebo.protocol import Op

    found["a request that does nothing"] = timed(lambda: inner.simulation.native[0].call(Op.HELLO), steps)
    env.close()
    return found, processor


def _thread_seconds(pid: int) -> dict[str, float]:
    """Return the processor time of each thread of a process [s]."""
    tasks = Path(f"/proc/{pid}/task")
    return {task: int((tasks / task / "schedstat").read_text().split()[0]) * 1e-9 for task in os.listdir(tasks)}


def bridge_speeds(joints: Joints, steps: int) -> dict[str, dict[str, float]]:
    """Return the durations of an environment step through ROS and of its parts, with the world paused."""
    from gazebo_msgs.srv import GetJointProperties, GetLinkState, GetModelState
    from std_srvs.srv import Empty

    from frobs_ros.ros.services import call

    rest = [0.0] * len(joints.names)

    def environment_step() -> None:
        joints.command(rest)
        joints.step()
        joints.states()
        call("/gazebo/get_link_state", GetLinkState, "tool0", "world")

    def step_and_hear() -> None:
        joints.step()
        joints.states()

    parts: dict[str, Callable[[], Any]] = {
        "an environment step: command, physics, joint states, the tool's pose": environment_step,
        "a command on a topic": lambda: joints.command(rest),
        f"{SUBSTEPS} physics steps by the service": joints.step,
        "the same, until their joint states arrive on the topic": step_and_hear,
        "a link's state by the service": lambda: call("/gazebo/get_link_state", GetLinkState, "tool0", "world"),
        "a joint's state by the service": lambda: call("/gazebo/get_joint_properties", GetJointProperties, "joint_1"),
        "a model's state by the service": lambda: call("/gazebo/get_model_state", GetModelState, ROBOT, "world"),
        "unpausing and pausing": lambda: (call("/gazebo/unpause_physics", Empty), call("/gazebo/pause_physics", Empty)),
    }
    return {name: timed(part, steps) for name, part in parts.items()}


def timed(function: Callable[[], Any], times: int) -> dict[str, float]:
    """Return ``rate`` of a function [1/s], and ``median`` and 95th percentile (``late``) of its duration [s]."""
    for _ in range(WARM_UP):
        function()
    seen = []
    for _ in range(times):
        start = perf_counter()
        function()
        seen.append(perf_counter() - start)
    return {"rate": len(seen) / sum(seen), "median": median(seen), "late": quantiles(seen, n=20)[-1]}


def success_table(success: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the success of the policy, and its ratio to that in the first place.

    Args:
        success: Results of :func:`success_on` and :func:`success_through_topics` by place; the first is the reference.
    """
    lines = ["| where | episodes | success | 95 % interval | kept |", "|---|---:|---:|---|---:|"]
    home = next(iter(success.values()))["success_rate"]
    for name, row in success.items():
        low, high = row["success_interval"]
        kept = f"{row['success_rate'] / home:.1%}" if home else "–"
        lines.append(f"| {name} | {row['episodes']:,} | {row['success_rate']:.1%} | {low:.1%} to {high:.1%} | {kept} |")
    return lines


def response_table(differences: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the differences between joint positions; see :func:`responses`."""
    lines = ["| measurement | simulator | what differs | by | allowed | where |", "|---|---|---|---:|---:|---|"]
    for row in differences:
        allowed = "–" if row["allowed"] is None else f"{row['allowed']:.2g}"
        lines.append(
            f"| {row['title']} | {row['simulator']} | {row['quantity']} | {row['error']:.2g} {row['unit']} | {allowed} | "
            f"{row['where']} |"
        )
    return lines


def cost_table(parts: Mapping[str, Mapping[str, float]], budget: float) -> list[str]:
    """Return the durations; the first one has a budget [1/s]."""
    lines = ["| what | per second | median | 95 % within |", "|---|---:|---:|---:|"]
    for n, (name, row) in enumerate(parts.items()):
        wanted = "" if n else f" (≥ {budget:g}{'' if row['rate'] >= budget else ': missed'})"
        lines.append(
            f"| {name} | {row['rate']:,.0f}{wanted} | {1e6 * row['median']:,.0f} µs | {1e6 * row['late']:,.0f} µs |"
        )
    return lines


def report(
    success: Mapping[str, Mapping[str, Any]],
    differences: Sequence[Mapping[str, Any]],
    gazebo: Mapping[str, Mapping[str, float]],
    processor: Mapping[str, float],
    parts: Mapping[str, Mapping[str, float]],
    load: float,
) -> str:
    """Return the page.

    Args:
        success: Results of :func:`success_on` and :func:`success_through_topics` by place; the latter include
            ``late``.
        differences: Results of :func:`responses` and :func:`bridge_response`.
        gazebo: Durations from :func:`gazebo_speeds`.
        processor: Processor times from :func:`gazebo_speeds`.
        parts: Results of :func:`bridge_speeds`.
        load: Number of other processes that were ready to run at the start.
    """
    late = success[TOPICS]["late"]
    spent = sum(processor.values())
    lines = [
        "# Benchmarks: ROS and Gazebo",
        "",
        f"Measured by `tests/benchmarks/ros.py` on {date.today():%d %B %Y}. Machine: {machine()}. Commit: {current_commit()}. In the "
        f"minute before the measurement, an average of {load:.1f} other processes were running or waiting for a processor; on an "
        "idle machine, this number is near 0 and steps are faster.",
        "",
        "## One policy everywhere",
        "",
        f"The policy that comes with `{ID}` was trained on MuJoCo and is evaluated without further training. Every simulator "
        "runs the same episodes (`frobs evaluate --simulator`). In the row *ROS topics*, the policy controls the robot through "
        "the ROS bridge to MuJoCo, as with `frobs ros run`: the policy reads joint states and sends a trajectory at each "
        "control step. Simulated time runs "
        f"{SPEED:g} times as fast as real time and does not wait for the policy. {late:.1%} of the policy's steps were "
        "late. The episodes in the row *ROS topics* use the same distributions of initial states and goals as the others, but "
        "different seeds.",
        "",
        *success_table(success),
        "",
        "## How joints respond",
        "",
        f"The table shows the largest differences from MuJoCo. `frobs parity {ID}` measures the differences between the "
        "simulators. It applies a step command to each joint and compares the simulators after every physics step of 2 ms. In "
        "the saturated response, the effort limits are only just sufficient. For *ROS topics*, MuJoCo behind the ROS bridge is "
        f"compared with MuJoCo without ROS: each joint receives a step command of {JUMP:g} rad on the topic of its position "
        f"controller, and `joint_states` is read every "
        f"{SUBSTEPS} steps of {1e3 * PHYSICS_TIMESTEP:g} ms. The tolerances and their reasons are in "
        "`plugins/frobs-devkit/src/frobs_devkit/parity/tolerances.py`.",
        "",
        *response_table(differences),
        "",
        "## Duration of a step on Gazebo",
        "",
        f"The measurement uses one environment with {SUBSTEPS} physics steps of 2 ms per step and random actions, and includes "
        "resets. FRobs_RL's logs show 3 to 4 steps per second.",
        "",
        *cost_table(gazebo, GAZEBO_BUDGET),
        "",
        "The processor time of an environment step is "
        f"{' and '.join(f'{1e6 * s:,.0f} µs in {who}' for who, s in processor.items())}. "
        f"Gazebo and Python take turns, so an idle machine reaches at most {1.0 / spent:,.0f} steps per second.",
        "",
        "## Duration of a step through ROS",
        "",
        f"The ROS bridge to MuJoCo runs in a separate process and is paused between steps; each environment step has {SUBSTEPS} physics steps of "
        f"{1e3 * PHYSICS_TIMESTEP:g} ms. Services use persistent connections. Each part is timed separately.",
        "",
        *cost_table(parts, BRIDGE_BUDGET),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=200, help="evaluation episodes per simulator")
    parser.add_argument("--topics", type=int, default=100, help="evaluation episodes through ROS topics")
    parser.add_argument("--steps", type=int, default=1000, help="number of timed steps")
    parser.add_argument("--out", type=Path, default=PAGE, help="path of the page")
    parser.add_argument("--gazebo-speed", action="store_true", help="only print the duration of a step on Gazebo")
    given = parser.parse_args()
    load = os.getloadavg()[0]
    if given.gazebo_speed:
        found, processor = gazebo_speeds(given.steps)
        spent = ", ".join(f"{who} {1e6 * seconds:,.0f} µs" for who, seconds in processor.items())
        sys.stdout.write("\n".join([*cost_table(found, GAZEBO_BUDGET), "", f"processor time of a step: {spent}\n"]))
        return
    success = {name: success_on(name, given.episodes) for name in SIMULATORS}
    differences = responses()
    gazebo, processor = gazebo_speeds(given.steps)
    with bridge():
        success[TOPICS] = success_through_topics(given.topics)
        joints = Joints()
        differences.append(bridge_response(joints))
        parts = bridge_speeds(joints, given.steps)
    given.out.write_text(report(success, differences, gazebo, processor, parts, load), "utf-8")


if __name__ == "__main__":
    main()
