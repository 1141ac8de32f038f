"""Write ``docs/reference/model-survey.md``: what became of every robot, on every installed simulator."""

from __future__ import annotations

import json
import sys
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from compare import TOLERANCE, Result, compare
from corpus import files
from free_motion import SECONDS, Motion, free_motion
from free_motion import TOLERANCE as APART
from vendors import FOUND

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "model-survey.md"
PAIR = ("mujoco", "pybullet")
"""The simulators whose free motion is compared."""
_VERDICTS = ("used", "limits", "rejected")
PACKAGES = ("example-robot-data", "pybullet", "pin", "trimesh", "mujoco")


def main() -> None:
    """Compare all, each file in a process for itself, and write the page."""
    simulators = sorted(PAIR)
    with get_context("spawn").Pool(maxtasksperchild=1) as pool:
        found = pool.map(examine, list(files().items()), chunksize=1)
    results = {name: result for name, result, _ in found}
    motions = {name: motion for name, _, motion in found if motion is not None}
    PAGE.write_text(page(results, motions, simulators), encoding="utf-8")


def examine(item: tuple[str, Path]) -> tuple[str, dict[str, Result], Motion | None]:
    """Return what became of a file on each simulator, and how alike it moves where all have built it."""
    name, file = item
    results = {simulator: compare(file, simulator) for simulator in sorted(PAIR)}
    motion = None if any(result.refused for result in results.values()) else free_motion(file, PAIR)
    return name, results, motion


def page(results: dict[str, dict[str, Result]], motions: dict[str, Motion], simulators: list[str]) -> str:
    """Return the page."""
    built = {name: found for name, found in results.items() if not found[simulators[0]].refused}
    refused = {name: found for name, found in results.items() if name not in built}
    versions = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    text = f"""# Survey of model files

The survey covers all URDF files with at least one movable joint in the Python packages example-robot-data and pybullet
(in `pybullet_data`): of {len(results)} files, {len(built)} can be built and {len(refused)} are rejected. Each robot is compared with its file, which
Pinocchio and trimesh read independently of FRobs: names, types, axes and limits of joints, mimic joints, mass, center
of mass and inertia of each link, the bounding box of the collision shapes (only approximately on PyBullet, whose shapes
include collision margins), and forward kinematics at 20 postures. *Differences* is the number of values that differ
from the file by more than {TOLERANCE:g}. Each difference is due to the {{doc}}`rule </explanation/model-files>` in the next
column, and a test verifies this. *Kinematics* is the largest distance [m] between the position of a link and its
position in Pinocchio.

*Motion* is the largest difference in joint positions between {PAIR[0]} and {PAIR[1]}, in % of the step, during {SECONDS:g} s after a
step command of 0.2 rad or 20 mm (or less near the limits) to each joint, with default gains and with collisions. For
robots with many joints, every eighth joint receives its step command at the same time. If the difference is above {APART:g} %,
the table cell also states its cause, and a test verifies that the motions agree if this cause is removed. Contact
models differ between engines, and a drive's damping is computed without regard to contacts ({{doc}}`/how-to/pybullet`).

Written by `python tests/public_robots/page.py` with {versions}.

"""
    heads = ["file", "links", "joints", "differences", "by the rules"]
    rows = [
        [*_row(name, found[simulators[0]]), *(_kinematics(found[s]) for s in simulators), _motion(motions.get(name))]
        for name, found in built.items()
    ]
    text += _table([*heads, *(f"kinematics: {simulator}" for simulator in simulators), "motion"], rows)
    text += "\n## Rejected\n\n"
    text += _table(
        ["file", "reason"], [[f"`{name}`", _reason(found[simulators[0]])] for name, found in refused.items()]
    )
    return text + vendors_section()


def vendors_section() -> str:
    """Return the tables of the models of public repositories, from what ``vendors.py`` found."""
    found = json.loads(FOUND.read_text("utf-8"))
    counts = {verdict: sum(what["verdict"] == verdict for what in found.values()) for verdict in _VERDICTS}
    text = f"""
## Models of public repositories

{len(found)} models of robot vendors and research groups were examined with `frobs doctor robot` on mujoco and pybullet. The list
with repositories, commits and licenses is `tests/public_robots/vendors.yaml`. {counts["used"]} models work on both simulators. {counts["limits"]}
models work with limits: one simulator rejects the model or ignores a part of its physics, and `frobs doctor robot`
reports the limitation. {counts["rejected"]} models are rejected with a one-line reason. No model causes a traceback.

The column *beside MuJoCo* compares a robot from an MJCF file with MuJoCo's own model of the same file: it lists the
largest differences in masses and inertias (relative), in joint properties, and in joint positions after 0.5 s without
drives [rad or m].

"""
    rows = []
    for name, what in found.items():
        beside = what["beside"] or {}
        rows.append(
            [
                f"`{name}`",
                what["verdict"],
                str(what["joints"] or ""),
                ", ".join(f"{code} × {count}" for code, count in (what["findings"] or {}).items()),
                ", ".join(f"{value:.0e}" for value in beside.values()),
            ]
        )
    text += _table(["model", "verdict", "joints", "errors and warnings", "beside MuJoCo"], rows)
    text += "\n### Reasons of rejection\n\n"
    reasons = [
        [f"`{name}`", who, reason.replace("<", "&lt;").replace("|", "\\|")]
        for name, what in found.items()
        for who, reason in (what["rejected"] or {}).items()
    ]
    return text + _table(["model", "by", "reason"], reasons)


def _row(name: str, result: Result) -> list[str]:
    model = result.model
    rules = sorted({note.rule for note in model.notes})
    joints = f"{len(model.joint_names)}"
    if followers := sum(joint.mimic is not None for joint in model.joints):
        joints += f" + {followers} that mimic"
    return [f"`{name}`", str(len(model.links)), joints, str(len(result.differences)), ", ".join(rules)]


def _kinematics(result: Result) -> str:
    return result.kinematics_note or f"{result.kinematics:.0e}" if not result.refused else f"refused: {_reason(result)}"


def _motion(motion: Motion | None) -> str:
    if motion is None or not motion.where:
        return ""
    if motion.difference <= APART:
        return f"{motion.difference:.0e} %"
    return f"{motion.difference:.0f} %: {' and '.join(motion.causes) or 'not understood'}"


def _reason(result: Result) -> str:
    """Return a reason without the folders of this machine."""
    words = result.refused.split(" Looked in: ")[0].split(": looked for ")[0].split()
    return " ".join(word for word in words if not word.startswith("/")).replace("<", "&lt;").replace("|", "\\|")


def _table(heads: list[str], rows: list[list[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    main()
