"""Measure how reaching is learned on arms that FRobs knows nothing of: their URDF files, and one command each.

The files are those of the PyPI packages example-robot-data and pybullet. Writes ``docs/explanation/arms-measured.md``; some
minutes for each controller::

    python tests/benchmarks/arms.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from time import perf_counter
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "public_robots"))

from corpus import files  # noqa: E402 - where the packages keep them

from frobs_train import evaluate, resolve_config, train  # noqa: E402

PAGE = ROOT / "docs" / "explanation" / "arms-measured.md"
ID = "frobs/Reach-v0"
CONTROLLERS = ("tcp_delta_position", "joint_delta_position")
_BENT = {"shoulder_lift_joint": -1.6, "elbow_joint": 1.6, "wrist_1_joint": -1.6, "wrist_2_joint": -1.6}
ARMS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "Franka Panda": ("example-robot-data/panda_description/urdf/panda.urdf", {}),
    "UR10": ("example-robot-data/ur_description/urdf/ur10_robot.urdf", {"home": _BENT}),
    "xArm6": ("pybullet_data/xarm/xarm6_robot.urdf", {}),
    "KUKA iiwa": ("pybullet_data/kuka_iiwa/model.urdf", {}),
    "SO-101": ("example-robot-data/so_arm_description/urdf/so101.urdf", {"tcp": "gripper_frame_link"}),
}
"""Each arm's file, and what is said beside it: the tool where the default is not meant, and the home of the UR10, whose
joints at zero stretch it out along the floor."""

SUCCESS, MINUTES = 0.9, 5
"""What each arm must reach, and in which time of training."""


def measure(controller: str, arm: str, episodes: int, steps: int | None = None) -> dict[str, Any]:
    """Train an arm, and evaluate it.

    Args:
        controller: Of the environment.
        arm: A key of :data:`ARMS`.
        episodes: Of the evaluation.
        steps: Of the training; None: as tuned for any arm.

    Returns:
        ``controller``, ``arm``, ``file``, ``said``, ``steps``, ``seconds`` of the training, ``success_rate`` and
        ``success_interval``.
    """
    file, said = ARMS[arm]
    flags = {"controller": controller, "robot": str(files()[file]), "seed": 0, "steps": steps}
    settings = [f"environment_kwargs.{key}={value}" for key, value in said.items()]
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        run = train(resolve_config(ID, flags=flags, settings=settings), Path(folder) / "run")
        seconds = perf_counter() - start
        found = evaluate(run, episodes)
    sys.stderr.write(f"{arm}, {controller}: {found.success_rate:.1%} after {seconds:.0f} s\n")
    return {
        "controller": controller,
        "arm": arm,
        "file": file,
        "said": settings,
        "steps": found.steps,
        "seconds": seconds,
        "success_rate": found.success_rate,
        "success_interval": found.success_interval,
    }


def report(rows: Sequence[Mapping[str, Any]], episodes: int) -> str:
    """Return the page."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, text=True, capture_output=True).stdout
    lines = [
        "# Any arm, measured",
        "",
        f"By `tests/benchmarks/arms.py`, {date.today():%d %B %Y}, at commit {commit.strip() or 'unknown'}: PPO with the "
        f"settings for any arm, from nothing but a URDF file, `frobs train {ID} --robot FILE --seed 0`. Success is that of "
        f"the deterministic policy on {episodes:,} new goals from all over the arm's reach, 5 cm, held at the end; at least "
        f"{SUCCESS:.0%} within {MINUTES} minutes of training are wanted.",
        "",
        "| arm | file | `--set` | controller | steps | training | success | 95 % interval |",
        "|---|---|---|---|---:|---:|---:|---|",
    ]
    for row in rows:
        low, high = row["success_interval"]
        said = " ".join(f"`{setting}`" for setting in row["said"]) or "–"
        lines.append(
            f"| {row['arm']} | `{row['file']}` | {said} | `{row['controller']}` | {row['steps']:,} | {row['seconds']:.0f} s | "
            f"{row['success_rate']:.1%} | {low:.1%} to {high:.1%} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--controllers", nargs="+", default=list(CONTROLLERS[:1]), choices=CONTROLLERS)
    parser.add_argument("--episodes", type=int, default=1000, help="for each arm")
    given = parser.parse_args()
    rows = [measure(controller, arm, given.episodes) for controller in given.controllers for arm in ARMS]
    PAGE.write_text(report(rows, given.episodes), "utf-8")


if __name__ == "__main__":
    main()
