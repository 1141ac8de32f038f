"""Write ``docs/reference/model-survey.md``: what became of every robot, on every installed simulator."""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from compare import TOLERANCE, Result, compare
from corpus import files

from frobs_core import plugins

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "model-survey.md"
PACKAGES = ("example-robot-data", "pybullet", "pin", "trimesh", "mujoco")


def main() -> None:
    """Compare all, and write the page."""
    simulators = sorted(plugins.records("simulator"))
    results = {
        name: {simulator: compare(file, simulator) for simulator in simulators} for name, file in files().items()
    }
    PAGE.write_text(page(results, simulators), encoding="utf-8")


def page(results: dict[str, dict[str, Result]], simulators: list[str]) -> str:
    """Return the page."""
    built = {name: found for name, found in results.items() if not found[simulators[0]].refused}
    refused = {name: found for name, found in results.items() if name not in built}
    versions = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    text = f"""# Survey of model files

Every URDF of the PyPI packages example-robot-data and pybullet (its `pybullet_data`) that has a joint that moves:
{len(results)} files, of which {len(built)} are built and {len(refused)} are refused. Each that is built is compared with
its file, which Pinocchio and trimesh read without FRobs: names, types, axes and limits of joints, what mimics what, mass,
centre of mass and inertia of each link, the box around what collides
(of PyBullet, which tells it with margins only, roughly), and forward kinematics at 20 postures.
*Differences* counts what is not as the file says it by more than {TOLERANCE:g}; each of them obeys the
{{doc}}`rule </explanation/model-files>` that stands beside it, and a test fails if one does not. *Kinematics* is the largest
distance [m] of any link from where Pinocchio has it.

Written by `python tests/survey/page.py` with {versions}.

"""
    heads = ["file", "links", "joints", "differences", "by the rules"]
    rows = [
        [*_row(name, found[simulators[0]]), *(_kinematics(found[s]) for s in simulators)]
        for name, found in built.items()
    ]
    text += _table([*heads, *(f"kinematics: {simulator}" for simulator in simulators)], rows)
    text += "\n## Refused\n\n"
    text += _table(
        ["file", "reason"], [[f"`{name}`", _reason(found[simulators[0]])] for name, found in refused.items()]
    )
    return text


def _row(name: str, result: Result) -> list[str]:
    model = result.model
    rules = sorted({note.rule for note in model.notes})
    joints = f"{len(model.joint_names)}"
    if followers := sum(joint.mimic is not None for joint in model.joints):
        joints += f" + {followers} that mimic"
    return [f"`{name}`", str(len(model.links)), joints, str(len(result.differences)), ", ".join(rules)]


def _kinematics(result: Result) -> str:
    return result.kinematics_note or f"{result.kinematics:.0e}" if not result.refused else f"refused: {_reason(result)}"


def _reason(result: Result) -> str:
    """Return a reason without the folders of this machine."""
    words = result.refused.split(" Looked in: ")[0].split(": looked for ")[0].split()
    return " ".join(word for word in words if not word.startswith("/")).replace("<", "&lt;").replace("|", "\\|")


def _table(heads: list[str], rows: list[list[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    main()
