"""Measure the controller ``trajectory``: move an arm to random goals among boxes, and check contacts in the engine.

Writes ``docs/explanation/trajectories-measured.md``; takes some minutes::

    python tests/benchmarks/trajectories.py
"""

from __future__ import annotations

import subprocess
import sys
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from datetime import date
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from frobs_controllers_planning.controller import TrajectoryController
from frobs_controllers_planning.plan import Reason
from frobs_core import plugins
from frobs_core.description import Body, Contact, Placement, Scene
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import Box, Pose, load_model
from frobs_core.util.arrays import Floats

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "explanation" / "trajectories-measured.md"

ROBOT = "irb120"
POSTS: Sequence[tuple[float, float, float]] = (
    (0.38, 0.30, 0.55),
    (0.42, -0.28, 0.35),
    (0.02, 0.45, 0.40),
    (-0.05, -0.42, 0.60),
    (-0.40, 0.10, 0.30),
)
"""Positions x and y, and heights [m], of posts of 10 × 10 cm around the arm."""
SHELF = Body(geometry=Box((0.30, 0.30, 0.04)), pose=Pose((0.45, 0.0, 0.75)))

PHYSICS_TIMESTEP, CONTROL_TIMESTEP = 0.002, 8.0
SETTLE = 0.4  # [s] after a motion
_CHUNK = 25  # physics steps between two checks of the joints
PLANNING_BUDGET = 0.1  # [s] median


def scene() -> Scene:
    """Return the boxes, and the contacts that the engine detects."""
    posts = {
        f"post_{i}": Body(geometry=Box((0.1, 0.1, height)), pose=Pose((x, y, height / 2)))
        for i, (x, y, height) in enumerate(POSTS)
    }
    bodies = {**posts, "shelf": SHELF}
    touched = {name: Contact(first="robot", second=name) for name in (*bodies, "floor", "robot")}
    return Scene(bodies=bodies, contacts=touched)


def measure(target: str, goals: int, seed: int = 0) -> dict[str, Any]:
    """Move the arm from goal to goal.

    Args:
        target: Value of the controller's setting ``target``.
        goals: Number of goals; each is the tool's pose for random joint positions without contact.
        seed: Seed of the goals.

    Returns:
        ``target``, ``goals``, ``reached``, ``straight`` (paths that are one line), ``collisions`` (motions with
        contact), ``reasons`` (of failures), ``plan_times``, ``processor_times`` and ``durations`` [s],
        ``velocity_share`` and ``acceleration_share`` of the limits that commands use, ``real_velocity_share`` of the
        joints themselves, ``lag`` of the joints behind the command [rad], and ``joint_error`` [rad] and ``tcp_error``
        [m] at the ends, each the largest.
    """
    description = RobotConfig(robot=ROBOT).describe()
    model = load_model(description.model, xacro_args=description.xacro_args, package_paths=description.package_paths)
    controller = TrajectoryController(target=target)
    placement = Placement(robot=description, model=model, command_mode=controller.command_mode)
    mujoco = plugins.get_record("simulator", "mujoco").load()
    surroundings = scene()
    found: dict[str, Any] = {"target": target, "goals": goals, "reached": 0, "straight": 0, "collisions": 0}
    found |= {"plan_times": [], "processor_times": [], "durations": [], "reasons": Counter()}
    largest = dict.fromkeys(
        ("velocity_share", "acceleration_share", "real_velocity_share", "lag", "joint_error", "tcp_error"), 0.0
    )

    def note(**values: float) -> None:
        for name, value in values.items():
            largest[name] = max(largest[name], float(value))

    with closing(
        mujoco({"robot": placement}, surroundings, num_envs=1, physics_timestep=PHYSICS_TIMESTEP)
    ) as simulation:
        robot = simulation.robots["robot"]
        simulation.reset()
        controller.bind_scene(surroundings, simulation)
        controller.bind(robot, CONTROL_TIMESTEP, round(CONTROL_TIMESTEP / PHYSICS_TIMESTEP))
        planner = controller.planner
        held = robot.joint_positions[0].copy()
        for action, pos in _goals(controller, goals, seed):
            begin = process_time()
            rows = controller.apply(action[None]).copy()
            found["processor_times"].append(process_time() - begin)
            told = {name: float(values[0]) for name, values in controller.info().items()}
            found["plan_times"].append(told["plan_time"])
            if not told["plan_success"]:
                found["reasons"][Reason(int(told["plan_reason"])).name.lower()] += 1
                continue
            found["durations"].append(told["motion_duration"])
            found["straight"] += told["plan_waypoints"] == 2
            velocities = np.diff(np.concatenate([held[None], rows[0]]), axis=0) / PHYSICS_TIMESTEP
            accelerations = np.diff(np.concatenate([np.zeros((1, robot.dof)), velocities]), axis=0) / PHYSICS_TIMESTEP
            note(
                velocity_share=(np.abs(velocities) / planner.max_velocity).max(),
                acceleration_share=(np.abs(accelerations) / planner.max_acceleration).max(),
            )
            touched = False
            steps = round((told["motion_duration"] + SETTLE) / PHYSICS_TIMESTEP / _CHUNK)
            for k in range(steps):
                part = rows[:, k * _CHUNK : (k + 1) * _CHUNK]
                robot.command(part)
                simulation.step(_CHUNK)
                touched = touched or any(bool(simulation.contact(name)[0]) for name in surroundings.contacts)
                note(
                    real_velocity_share=(np.abs(robot.joint_velocities[0]) / planner.max_velocity).max(),
                    lag=np.abs(part[0, -1] - robot.joint_positions[0]).max(),
                )
            found["collisions"] += touched
            held = rows[0, -1]
            tcp_error = float(np.linalg.norm(robot.frame_pose("tcp")[0][0] - pos))
            note(joint_error=np.abs(held - robot.joint_positions[0]).max(), tcp_error=tcp_error)
            found["reached"] += not touched and tcp_error < 0.05
    return {**found, **largest}


def _goals(controller: TrajectoryController, goals: int, seed: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield actions, and the tool positions (3,) to which they should lead [m]."""
    planner, rng = controller.planner, np.random.default_rng(seed)
    low, high = controller.workspace
    while goals:
        action = rng.uniform(-1.0, 1.0, len(planner.home))
        joint_positions = planner.lower + 0.5 * (planner.upper - planner.lower) * (action + 1.0)
        pos = planner.tool_pos(joint_positions)
        if not planner.is_free(joint_positions):
            continue
        if controller.target == "tcp":
            action = 2.0 * (pos - low) / (high - low) - 1.0
            if np.abs(action).max() > 1.0:
                continue
        goals -= 1
        yield action, pos


def report(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the page."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True, capture_output=True).stdout
    lines = [
        "# Benchmarks: planned motions",
        "",
        f"Measured by `tests/benchmarks/trajectories.py` on {date.today():%d %B %Y}, at commit {commit.strip() or 'unknown'}. The "
        f"`trajectory` controller, with default settings, moves an IRB 120 in MuJoCo from goal to goal, among {len(POSTS)} posts, "
        "under a shelf and above the floor. Each goal is the tool position for random joint positions within the limits. "
        "Joint positions that cause contact or leave too little clearance are drawn again. At every physics step, the engine "
        "reports contacts of the arm with a box, the floor or itself. A goal counts as reached if the arm touches nothing on "
        "the way and the tool stops within 5 cm of the goal. The targets are that every motion is collision-free and that the "
        f"median planning time is at most {PLANNING_BUDGET * 1000:.0f} ms. Planning time is wall-clock time, which other programs may have lengthened; processor "
        "time is not affected by other programs.",
        "",
        "| | " + " | ".join(f'`target="{row["target"]}"`' for row in rows) + " |",
        "|---|" + "---:|" * len(rows),
    ]

    def line(name: str, values: Sequence[str]) -> None:
        lines.append(f"| {name} | " + " | ".join(values) + " |")

    def milliseconds(row: Mapping[str, Any], percentile: float, times: str = "plan_times") -> str:
        return f"{np.percentile(row[times], percentile) * 1000:.0f} ms"

    line("goals", [f"{row['goals']:,}" for row in rows])
    line("reached", [f"{row['reached']:,} ({row['reached'] / row['goals']:.1%})" for row in rows])
    line("motions with a collision", [f"{row['collisions']}" for row in rows])
    line("no plan", [", ".join(f"{n} × {why}" for why, n in row["reasons"].items()) or "none" for row in rows])
    line("ways that are not one straight line", [f"{len(row['durations']) - row['straight']:,}" for row in rows])
    line("planning, median", [milliseconds(row, 50) for row in rows])
    line("planning, median of the processor's time", [milliseconds(row, 50, "processor_times") for row in rows])
    line("planning, 95 % within", [milliseconds(row, 95) for row in rows])
    line("planning, longest", [milliseconds(row, 100) for row in rows])
    line("a motion takes, median", [f"{np.median(row['durations']):.1f} s" for row in rows])
    line("a motion takes, longest", [f"{np.max(row['durations']):.1f} s" for row in rows])
    for name, what in (
        ("velocity_share", "largest velocity of the command, of the limit"),
        ("acceleration_share", "largest acceleration of the command, of the limit"),
        ("real_velocity_share", "largest velocity of a joint itself, of the limit"),
    ):
        line(what, [f"{row[name]:.2%}" for row in rows])
    line("farthest that a joint lags behind the command", [f"{row['lag'] * 1000:.0f} mrad" for row in rows])
    line("farthest that a joint ends from its goal", [f"{row['joint_error'] * 1000:.0f} mrad" for row in rows])
    line("farthest that the tool ends from its goal", [f"{row['tcp_error'] * 1000:.0f} mm" for row in rows])
    lines += [
        "",
        "The controller must respect two limits for each joint: half of its velocity limit in the model file, and half of the "
        "acceleration at which the joint reaches that velocity limit within half a second. The commanded velocities and "
        "accelerations are computed from the positions at consecutive physics steps. The drives have no feed-forward, so each "
        "joint lags behind its command by about 2·q̇/ω, where ω is the bandwidth of its drive, and gravity pulls the arm below "
        "the commanded position. For these reasons, the clearance is 2 cm, and a joint may move slightly faster than its command.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--goals", type=int, default=1000, help="total number of goals, half of them per target")
    given = parser.parse_args()
    rows = [measure(target, given.goals // 2, seed) for seed, target in enumerate(("joint", "tcp"))]
    page = report(rows)
    sys.stdout.write(page)
    PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
