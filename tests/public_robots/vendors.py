"""Models of public repositories: what ``frobs doctor`` finds in each, and how MJCF robots compare with bare MuJoCo.

``vendors.yaml`` lists the repositories, their commits and the files. This script examines checkouts of them and writes
``vendors_found.json``, from which ``page.py`` writes the survey::

    python tests/public_robots/vendors.py FOLDER

where FOLDER contains one folder ``owner+name`` for each repository. To examine a model again, remove it from the file.
"""

from __future__ import annotations

import json
import logging
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import yaml

sys.path.insert(0, str(Path(__file__).parent))

FOUND = Path(__file__).with_name("vendors_found.json")
LIST = Path(__file__).with_name("vendors.yaml")
SIMULATORS = ("mujoco", "pybullet")
_UNFORESEEN = re.compile(r"^\w*(Error|Exception|Warning): ")
"""How the doctor reports an exception that no plugin raised on purpose."""


@dataclass(frozen=True)
class Found:
    """What became of one model.

    Attributes:
        verdict: ``"used"``, ``"limits"`` if one simulator rejects it or lacks a part of its physics, or ``"rejected"``.
        joints: Actuated joints.
        links: Links.
        findings: How often the doctor reports each code that is an error or a warning.
        rejected: Reason of each simulator that rejects the model, or of the reader under ``"file"``.
        beside: Largest differences from bare MuJoCo, for MJCF: bodies, joints and motion.
        unforeseen: Exceptions that FRobs did not raise on purpose.
    """

    verdict: str
    joints: int = 0
    links: int = 0
    findings: dict[str, int] | None = None
    rejected: dict[str, str] | None = None
    beside: dict[str, float] | None = None
    unforeseen: tuple[str, ...] = ()


def models(folder: Path) -> Iterator[tuple[str, Path, Path]]:
    """Yield the name of each listed model, its file, and the checkout that holds it."""
    for repository, facts in yaml.safe_load(LIST.read_text("utf-8")).items():
        checkout = folder / repository.replace("/", "+")
        for file in facts["files"]:
            yield f"{repository}/{file}", checkout / file, checkout


def examine(item: tuple[str, Path, Path]) -> tuple[str, dict[str, Any]]:
    """Return the name of a model, and what became of it."""
    import mujoco
    from bare_mujoco import beside_mujoco

    from frobs_core.util.errors import FrobsError
    from frobs_devkit.doctor import Severity, examine_robot
    from frobs_models import package_name

    name, file, checkout = item
    logging.disable()
    warnings.simplefilter("ignore")
    packages = {package_name(path.parent): path.parent for path in checkout.rglob("package.xml")}
    try:
        report = examine_robot(file, package_paths=packages, simulators=SIMULATORS)
    except FrobsError as error:
        return name, asdict(Found("rejected", rejected={"file": _shorten(getattr(error, "reason", str(error)))}))
    except Exception as error:
        return name, asdict(Found("rejected", unforeseen=(f"{type(error).__name__}: {error}",)))
    codes = [finding.code for finding in report.findings if finding.severity is not Severity.NOTE]
    rejected = {simulator.name: simulator.reason for simulator in report.simulators if not simulator.builds}
    built = len(rejected) < len(SIMULATORS) and report.usable
    for finding in report.findings:
        if finding.severity is Severity.ERROR:
            rejected.setdefault("frobs doctor", f"{finding.about}: {finding.problem}")
    unforeseen = [reason for reason in rejected.values() if _UNFORESEEN.match(reason)]
    beside = None
    if report.file_format == "mjcf" and "mujoco" not in rejected:
        try:
            mujoco.MjModel.from_xml_path(str(file))
        except ValueError as error:
            rejected["bare MuJoCo"] = str(error)
        else:
            try:
                beside = asdict(beside_mujoco(file))
            except Exception as error:
                unforeseen.append(f"{type(error).__name__}: {error}")
    complete = report.usable and all(simulator.complete for simulator in report.simulators)
    found = Found(
        "used" if complete else "limits" if built else "rejected",
        report.dof,
        len(report.links),
        {code: codes.count(code) for code in dict.fromkeys(codes)},
        {simulator: _shorten(reason) for simulator, reason in rejected.items()},
        beside,
        tuple(unforeseen),
    )
    return name, asdict(found)


def _shorten(reason: str) -> str:
    """Return the first sentence of a reason, without folders of this machine."""
    words = reason.split(" Looked in: ")[0].split(": looked for ")[0].split()
    return " ".join(word for word in words if not word.startswith(("/", "'/")))[:200]


def main(folder: Path) -> None:
    """Examine all models that are not in the file of what was found, and write it after each."""
    found = json.loads(FOUND.read_text("utf-8")) if FOUND.exists() else {}
    waiting = [item for item in models(folder) if item[0] not in found]
    with get_context("spawn").Pool(2, maxtasksperchild=10) as pool:
        for name, what in pool.imap_unordered(examine, waiting):
            found[name] = what
            FOUND.write_text(json.dumps(dict(sorted(found.items())), indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
