"""Measure how ten arms from public URDF files learn to reach, by tool actions and by joint actions.

The URDF files come from the PyPI packages example-robot-data and pybullet. The script writes
``docs/explanation/arms-measured.md`` and takes about an hour on an idle core::

    python tests/benchmarks/arms.py

``arms_measured.json`` next to this script stores each result, so that a measurement can be interrupted, split into
several processes, and continued on another machine. ``--kept`` writes the page from these results without training::

    python tests/benchmarks/arms.py --only UR10 "Franka Panda"
    python tests/benchmarks/arms.py --kept
"""

from __future__ import annotations

import json
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from time import process_time
from typing import Any, cast

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "public_robots"))

sys.path.insert(0, str(Path(__file__).parent))

from common import current_commit, is_shared  # noqa: E402
from corpus import files  # noqa: E402 - where the packages keep them
from fingerprints import add_fingerprints, defining_files, fingerprint, footnotes, mark  # noqa: E402

from frobs_train import evaluate, resolve_config, train  # noqa: E402

PAGE = ROOT / "docs" / "explanation" / "arms-measured.md"
RECORD = Path(__file__).with_name("arms_measured.json")
ID = "frobs/Reach-v0"
WANTED: Mapping[str, float] = {"tcp_delta_position": 0.9, "joint_delta_position": 0.85}
"""Minimum success of each arm, by controller."""
_SHARED = (
    " The machine was shared: other programs ran at the same time, which increases the processor time. Compare steps "
    "rather than times."
)
MINUTES = 5
"""Maximum processor time of a training run [min]."""
_BENT = {"shoulder_lift_joint": -1.6, "elbow_joint": 1.6, "wrist_1_joint": -1.6, "wrist_2_joint": -1.6}
ARMS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "Franka Panda": ("example-robot-data/panda_description/urdf/panda.urdf", {}),
    "UR10": ("example-robot-data/ur_description/urdf/ur10_robot.urdf", {"home": _BENT}),
    "UR5": ("example-robot-data/ur_description/urdf/ur5_robot.urdf", {"home": _BENT}),
    "UR3": ("example-robot-data/ur_description/urdf/ur3_robot.urdf", {"home": _BENT}),
    "xArm6": ("pybullet_data/xarm/xarm6_robot.urdf", {}),
    "xArm7": ("example-robot-data/xarm_description/urdf/xarm7.urdf", {}),
    "KUKA iiwa": ("pybullet_data/kuka_iiwa/model.urdf", {}),
    "SO-101": ("example-robot-data/so_arm_description/urdf/so101.urdf", {"tcp": "gripper_frame_link"}),
    "Unitree Z1": ("example-robot-data/z1_description/urdf/z1.urdf", {}),
    "Kinova Jaco": ("example-robot-data/kinova_description/robots/kinova.urdf", {"control_timestep": 0.1}),
}
"""The file of each arm, and its keywords.

The keywords set the tool, if the default link is not the tool; a home for the UR arms, whose joints at zero stretch
them out along the floor; and longer steps for the Kinova Jaco, whose joints turn 1.3 rad in the usual 2 s of an
episode.
"""


def measure(
    controller: str, arm: str, episodes: int, steps: int | None = None, record: Path = RECORD
) -> dict[str, Any]:
    """Train an arm and evaluate it, or return the recorded result.

    Args:
        controller: Controller of the environment.
        arm: A key of :data:`ARMS`.
        episodes: Number of episodes of the evaluation.
        steps: Number of steps of the training run; None: the tuned number.
        record: File of the results.

    Returns:
        ``controller``, ``arm``, ``steps``, ``seconds`` of processor time of the training run, ``shared`` (whether other
        programs slowed it), ``success_rate``, ``success_interval``, ``commit`` and ``files`` (the
        fingerprint of what defines it).
    """
    if (known := recorded(controller, arm, record)) is not None:
        return known
    file, keywords = ARMS[arm]
    flags = {"controller": controller, "robot": str(files()[file]), "seed": 0, "steps": steps}
    commit, defined_by = current_commit(), fingerprint(ID, "ppo", controller)
    with tempfile.TemporaryDirectory() as folder:
        start = process_time()
        run = train(resolve_config(ID, flags=flags, settings=_settings(keywords)), Path(folder) / "run")
        seconds = process_time() - start
        found = evaluate(run, episodes)
    sys.stderr.write(f"{arm}, {controller}: {found.success_rate:.1%} after {seconds:.0f} s\n")
    row = {
        "controller": controller,
        "arm": arm,
        "steps": found.steps,
        "seconds": seconds,
        "shared": is_shared(),
        "success_rate": found.success_rate,
        "success_interval": found.success_interval,
        "commit": commit,
        "files": defined_by,
    }
    _write([*_read(record), row], record)  # read again, because another process may have added a row
    return row


def recorded(controller: str, arm: str, record: Path = RECORD) -> dict[str, Any] | None:
    """Return the recorded result; None if there is none."""
    return next((row for row in _read(record) if (row["controller"], row["arm"]) == (controller, arm)), None)


def report(rows: Sequence[Mapping[str, Any]], episodes: int) -> str:
    """Return the page."""
    wanted = " and ".join(f"{share:.0%} with `{controller}`" for controller, share in WANTED.items())
    lines = [
        "# Benchmarks: any arm",
        "",
        f"Written by `tests/benchmarks/arms.py` on {date.today():%d %B %Y}. PPO was trained on each arm from its URDF "
        f"file alone, with settings that suit any arm: `frobs train {ID} --robot FILE --controller NAME --seed 0`. Each "
        f"policy was evaluated deterministically in {episodes:,} episodes, each with a new goal from anywhere within the arm's "
        f"reach. Success is the share of episodes that end with the tool within 5 cm of the goal. The target is at least {wanted}, within {MINUTES} minutes "
        "of processor time.",
        "",
        "Processor time is the sum over all threads of the training run."
        + (_SHARED if any(r["shared"] for r in rows) else ""),
        "",
        "A slow arm needs longer control steps: the joints of the Kinova Jaco turn at most 0.8 rad/s, so the usual episode "
        "length of 2 s is too short for them.",
        "",
        "| arm | controller | steps | processor time | success | 95 % interval | commit |",
        "|---|---|---:|---:|---:|---|---|",
    ]
    current = {controller: fingerprint(ID, "ppo", controller) for controller in WANTED}
    for row in rows:
        low, high = row["success_interval"]
        missed = " (missed)" if row["success_rate"] < WANTED[row["controller"]] else ""
        lines.append(
            f"| {row['arm']} {mark([row], current[row['controller']])}".rstrip()
            + f" | `{row['controller']}` | {row['steps']:,} | {row['seconds'] / 60:.1f} min | "
            f"{row['success_rate']:.1%}{missed} | {low:.1%} to {high:.1%} | {row['commit']} |"
        )
    lines += footnotes(
        {f"{row['arm']} with `{row['controller']}`": ([row], current[row["controller"]]) for row in rows}
    )
    measured = {(row["arm"], row["controller"]) for row in rows}
    if missing := [f"{arm} with `{name}`" for arm in ARMS for name in WANTED if (arm, name) not in measured]:
        lines += ["", f"Not measured yet: {', '.join(missing)}."]
    lines += ["", "## Files", "", "| arm | file | `--set` |", "|---|---|---|"]
    for arm in dict.fromkeys(row["arm"] for row in rows):
        file, keywords = ARMS[arm]
        settings = " ".join(f"`{setting}`" for setting in _settings(keywords)) or "–"
        lines.append(f"| {arm} | `{file}` | {settings} |")
    return "\n".join(lines) + "\n"


def _read(record: Path) -> list[dict[str, Any]]:
    return cast("list[dict[str, Any]]", json.loads(record.read_text("utf-8"))) if record.is_file() else []


def _write(rows: Sequence[Mapping[str, Any]], record: Path) -> None:
    order = [(arm, controller) for arm in ARMS for controller in WANTED]
    rows = sorted(rows, key=lambda row: order.index((row["arm"], row["controller"])))
    record.write_text(json.dumps(rows, indent=1) + "\n", "utf-8")


def _settings(keywords: Mapping[str, Any]) -> list[str]:
    return [f"environment_kwargs.{key}={value}" for key, value in keywords.items()]


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument(
        "--only", nargs="+", choices=list(ARMS), metavar="ARM", help="measure only these arms; writes no page"
    )
    parser.add_argument("--controllers", nargs="+", default=list(WANTED), choices=list(WANTED))
    parser.add_argument("--episodes", type=int, default=1000, help="evaluation episodes per arm")
    parser.add_argument("--fresh", action="store_true", help="discard existing results")
    parser.add_argument("--kept", action="store_true", help="write the page from existing results without training")
    parser.add_argument(
        "--fingerprints",
        action="store_true",
        help="only add fingerprints to results that have none, from their commits",
    )
    given = parser.parse_args()
    if given.fingerprints:
        add_fingerprints(RECORD, lambda row: defining_files(ID, "ppo", row["controller"]))
        return
    chosen = [(controller, arm) for arm in given.only or ARMS for controller in given.controllers]
    if given.fresh:
        _write([row for row in _read(RECORD) if (row["controller"], row["arm"]) not in chosen], RECORD)
    if given.kept:
        chosen = [case for case in chosen if recorded(*case) is not None]
    rows = [measure(*case, given.episodes) for case in chosen]
    if not given.only:
        PAGE.write_text(report(rows, given.episodes), "utf-8")


if __name__ == "__main__":
    main()
