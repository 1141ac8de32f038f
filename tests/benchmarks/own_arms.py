"""Measure arms that nobody described for FRobs, from their files alone: ``docs/explanation/own-arms-measured.md``.

For each arm with a gripper, the script looks for the gripper, moves the tool to random goals, and lets the scripted
expert pick and place. The arms are those of the packages ``example-robot-data`` and ``pybullet_data``, those of the
public repositories in ``own_arms.yaml`` if ``--checkouts`` names a folder with one folder ``owner+name`` each, and the
files and folders that you name. Results are stored, so an interrupted measurement continues where it stopped::

    python tests/benchmarks/own_arms.py
    python tests/benchmarks/own_arms.py my_arm.urdf folder_of_arms --results my_results --page my_page.md
    python tests/benchmarks/own_arms.py my_arm.urdf.xacro --arg dof=6 --package my_description=../my_description --train
    python tests/benchmarks/own_arms.py --kept

Exits with status 1 if an expert succeeds less often than it must.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

sys.path.insert(0, str(Path(__file__).parents[1] / "public_robots"))
sys.path.insert(0, str(Path(__file__).parent))

import corpus
from common import RESULTS, ROOT, frobs, stored

from frobs_core.util.files import write_json

PAGE = ROOT / "docs" / "explanation" / "own-arms-measured.md"
KEPT = RESULTS / "own_arms"
LIST: Mapping[str, Any] = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text("utf-8"))
ID, REACH = "frobs/PickAndPlace-v0", "frobs/Reach-v0"
EPISODES, REACHES, OTHER_EPISODES = 500, 20, 100
OTHERS = ("Lift", "Push", "Stack")
"""Tasks that are also measured with ``--others``."""
WANTED, LONGEST = 0.98, 30.0
"""Minimum success rate of the expert, and maximum processor time to find the gripper and to fit the task [s]."""
UNSERVED = {"example-robot-data/talos_data/robots/talos_left_arm.urdf": "has no working area"}
"""Arms of the packages that have a gripper but cannot do the task, each with a part of the reason."""
ENDINGS = (".urdf", ".xacro", ".xml", ".mjcf")


@dataclass(frozen=True)
class Arm:
    """An arm to measure.

    Attributes:
        name: Name in the table.
        file: A URDF, xacro or MJCF file.
        maker: Maker of the arm, if known.
        xacro_args: Arguments of a xacro file.
        package_paths: Folders of ROS packages.
        gripper: File of a gripper to attach to the arm, or None.
        link: Link to which the gripper is attached, or None for the default tool.
    """

    name: str
    file: Path
    maker: str = ""
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    package_paths: Mapping[str, Path] = field(default_factory=dict)
    gripper: Path | None = None
    link: str | None = None

    def write(self, folder: Path) -> Path:
        """Write the whole arm as one URDF file, unless its file is one, and return the path."""
        from frobs_core.description import Robot
        from frobs_core.models import default_tcp

        folders = {name: str(path) for name, path in self.package_paths.items()}
        robot = Robot(model=str(self.file), name="arm", xacro_args=self.xacro_args, package_paths=folders)
        if self.gripper:
            gripper = Robot(model=str(self.gripper), name="gripper", package_paths=folders)
            return Path(robot.attach(self.link or default_tcp(robot.read_model()), gripper).model)
        if self.file.suffix != ".xacro":
            return self.file
        file = folder / f"{_slug(self.name)}.urdf"
        file.write_text(robot.read_model().xml, "utf-8")
        return file


def package_arms() -> list[Arm]:
    """Return the arms with a gripper, and the files to refuse, of the installed packages."""
    files = corpus.files()
    makers = {**LIST["packages"], **dict.fromkeys(LIST["refused"], "")}
    return [Arm(name, files[name], maker) for name, maker in makers.items() if name in files]


def public_arms(checkouts: Path) -> list[Arm]:
    """Return the arms of public repositories, whose checkouts are in folders ``owner+name``."""
    arms = []
    for name, facts in (LIST["public"] or {}).items():
        packages = {package: checkouts / folder for package, folder in facts.get("packages", {}).items()}
        file, gripper = checkouts / facts["file"], facts.get("gripper")
        arm = Arm(name, file, facts["maker"], facts.get("xacro_args", {}), packages, link=facts.get("link"))
        arms.append(replace(arm, gripper=checkouts / gripper) if gripper else arm)
    return [arm for arm in arms if arm.file.is_file()]


def named_arms(paths: Sequence[Path], xacro_args: Mapping[str, str], packages: Mapping[str, Path]) -> Iterator[Arm]:
    """Yield the files that a user names, and the model files in the folders that a user names."""
    for path in paths:
        if path.is_file():
            yield Arm(path.name, path.resolve(), "", xacro_args, packages)
            continue
        for file in sorted(path.rglob("*")):
            if file.suffix in ENDINGS and _is_model(file):
                yield Arm(file.relative_to(path).as_posix(), file.resolve(), "", xacro_args, packages)


def _is_model(file: Path) -> bool:
    """Return whether a file contains joints and is a whole robot, not a file of macros."""
    text = file.read_text("utf-8", errors="replace")
    return bool(re.search(r"<(robot|mujoco)\b", text)) and "joint" in text


def measure(
    arm: Arm, episodes: int, simulator: str, trains: bool, kept: Path = KEPT, others: bool = False
) -> dict[str, Any]:
    """Measure an arm, or return the stored results if they are of enough episodes.

    Returns:
        ``refused`` with the reason if the file has no gripper. Otherwise facts of the gripper and of the fitted task,
        ``derive_cpu_s``, ``reach``, ``expert`` and its interval, and ``failed`` with the reason if a step raised an error.
    """
    file = kept / f"{_slug(arm.name)}-{simulator}.json"
    if file.is_file():
        found = stored(file, dict)
        if not found.get("refused") and found.get("episodes", 0) < episodes:
            file.unlink()
    found = stored(file, _measure, arm, episodes, simulator)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        before = dict(found)
        if others and "lift" not in found and not {"refused", "failed"} & {*found}:
            found |= {task.lower(): _play_other(task, arm.write(folder), simulator) for task in OTHERS}
        if trains and "trained" not in found and not {"refused", "failed"} & {*found}:
            found |= train(arm.write(folder), episodes, simulator, folder / "run")
    if found != before:
        write_json(file, found)
    return found


def _slug(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def _measure(arm: Arm, episodes: int, simulator: str) -> dict[str, Any]:
    start = time.process_time()
    facts: dict[str, Any] = {"name": arm.name, "maker": arm.maker, "simulator": simulator, "episodes": episodes}
    with tempfile.TemporaryDirectory() as folder:
        return _told(_measured(arm, facts, episodes, simulator, Path(folder), start))


def _measured(
    arm: Arm, facts: dict[str, Any], episodes: int, simulator: str, folder: Path, start: float
) -> dict[str, Any]:
    from frobs_core.util.errors import FrobsError
    from frobs_devkit.doctor import examine_robot

    try:
        file = arm.write(folder)
        report = examine_robot(file, package_paths=arm.package_paths, simulators=[simulator])
    except FrobsError as error:
        return {**facts, "refused": _short(getattr(error, "reason", str(error)))}
    gripper = report.gripper
    if gripper is None:
        return {**facts, "refused": _short(report.no_gripper)}
    facts |= {
        "axes": len(gripper.arm),
        "drives": len(gripper.joints),
        "one_jaw": gripper.has_one_jaw,
        "gap_mm": [round(1000 * each, 1) for each in gripper.gap],
        "doctor_s": round(time.process_time() - start, 1),
    }
    try:
        facts |= _play(file, episodes, simulator)
    except Exception as error:  # every failure is a row of the table
        facts["failed"] = _short(f"{type(error).__name__}: {error}")
    return facts


def _play(file: Path, episodes: int, simulator: str) -> dict[str, Any]:
    """Return what was fitted, and how often the tool reaches goals and the expert succeeds."""
    import gymnasium as gym

    from frobs_train import evaluate, open_policy

    settings = [f"environment_kwargs.robot={file}"]
    start = time.process_time()
    with closing(gym.make_vec(f"frobs_core:{ID}", num_envs=1, robot=str(file), simulator=simulator)) as env:
        task: Any = env.unwrapped.task  # type: ignore[attr-defined]
        facts = {
            "derive_cpu_s": round(time.process_time() - start, 1),
            "object_mm": round(1000 * task.size, 1),
            "area_m": round(task.area, 3),
            "highest_m": round(task.highest, 3),
            "tolerance_mm": round(1000 * task.tolerance, 1),
            "radial": bool(task.grasp.radial),
            "steps": env.unwrapped.max_episode_steps,  # type: ignore[attr-defined]
            "reach": _reach(file, simulator),
        }
    found = evaluate(open_policy(ID, "expert", settings=settings), episodes, simulator=simulator)
    return {**facts, "expert": found.success_rate, "interval": list(found.success_interval)}


def _play_other(task: str, file: Path, simulator: str) -> float | str:
    """Return how often the expert succeeds in another task, or the reason why the arm cannot do it."""
    from frobs_core.util.errors import FrobsError
    from frobs_train import evaluate, open_policy

    policy = open_policy(f"frobs/{task}-v0", "expert", settings=[f"environment_kwargs.robot={file}"])
    try:
        return evaluate(policy, OTHER_EPISODES, simulator=simulator).success_rate
    except FrobsError as error:
        return _short(str(error))


def _reach(file: Path, simulator: str) -> float:
    """Return how often the tool is at a random goal after its joints moved to a posture that inverse kinematics found."""
    import gymnasium as gym
    import numpy as np

    from frobs_tasks_manipulation.posture import ToolKinematics

    settings = {"robot": str(file), "simulator": simulator, "controller": "joint_delta_position"}
    slow = {"max_delta": 0.05}  # [rad], which weak drives can follow
    with closing(gym.make_vec(f"frobs_core:{REACH}", num_envs=REACHES, controller_kwargs=slow, **settings)) as env:
        task, robot = env.unwrapped.task, env.unwrapped.robot  # type: ignore[attr-defined]
        env.reset(seed=0)
        arm = ToolKinematics.of(robot, False).counting(np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
        found = (arm.find(goal, np.array([1.0, 0.0, 0.0, 0.0])) for goal in task.goal)
        postures = np.array([robot.home[0] if each is None else each for each in found])
        names = next(iter(robot.robot.groups.values()), robot.joint_names)
        driven = [robot.joint_names.index(name) for name in names]
        action = np.zeros(env.action_space.shape, np.float32)
        for _ in range(95):
            step = (postures - robot.joint_positions)[:, driven]
            action[:, : len(driven)] = np.clip(step / 0.1, -1.0, 1.0)
            env.step(action)
        return float(task.is_success().mean())


def train(file: Path, episodes: int, simulator: str, run: Path, *options: str) -> dict[str, Any]:
    """Return the success rate of a policy that was trained with one command, and the time of training [s]."""
    start = time.perf_counter()
    frobs("train", ID, "--robot", file, "--algorithm", "dagger", "--simulator", simulator, "--run-dir", run, *options)
    seconds = round(time.perf_counter() - start, 1)
    return {"trained": frobs("evaluate", run, "--episodes", episodes)["success_rate"], "train_s": seconds}


def _short(reason: str) -> str:
    """Return the first two sentences of a reason, without folders of this machine."""
    words = " ".join(reason.split()).removeprefix("has no gripper that FRobs recognizes: ")
    words = re.sub(r"/\S+/", "", words)
    return ". ".join(words.split(". ")[:2]).rstrip(".")[:240]


def _told(facts: dict[str, Any]) -> dict[str, Any]:
    shown = {
        key: facts[key] for key in ("name", "refused", "failed", "reach", "expert", "derive_cpu_s") if key in facts
    }
    sys.stderr.write(f"{shown}\n")
    return facts


def report(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`measure`.
    """
    played = [row for row in rows if "refused" not in row]
    commits = sorted({row["commit"] for row in rows})
    lines = [
        "# Benchmarks: arms from their files",
        "",
        f"Written by `tests/benchmarks/own_arms.py`. Commits: {', '.join(commits)}. FRobs finds "
        "the gripper of each arm in the arm's model file and fits the task to the arm. Nothing else is known about the "
        "arm. Repeat the measurement, or measure the files in a folder of your own:",
        "",
        '```bash skip="it takes hours"',
        "python tests/benchmarks/own_arms.py",
        "python tests/benchmarks/own_arms.py FOLDER --results my_results --page my_page.md",
        "```",
        "",
        f"The scripted expert of `{ID}` must succeed in at least {WANTED:.0%} of the episodes on MuJoCo, and finding the gripper "
        f"and fitting the task may take at most {LONGEST:.0f} s of processor time. Column *reach*: how often the tool is within 5 cm of a "
        f"random goal of `{REACH}`, in {REACHES} episodes, after the joints moved to a posture that inverse kinematics found. The area is a square with the given "
        "side, and half of the goals are in the air. *Lift*, *push* and *stack* are the expert's success rates in "
        f"{OTHER_EPISODES} episodes of those tasks.",
        "",
        "| arm | maker | axes | gripper | gap | object | area | tolerance | steps | derived in | reach | expert | episodes "
        "| trained | lift | push | stack |",
        "|---|---|---:|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    lines += [_row(row) for row in played if "failed" not in row]
    waiting = [name for name in LIST["packages"] if name not in {row["name"] for row in rows}]
    if waiting:
        lines += ["", f"Not measured yet: {', '.join(waiting)}."]
    for simulator in sorted({row["simulator"] for row in rows}):
        rates = [row["expert"] for row in played if "expert" in row and row["simulator"] == simulator]
        if rates:
            lines += ["", f"Mean of the expert on `{simulator}`: {sum(rates) / len(rates):.1%} ({len(rates)} arms)."]
    for title, key in (("Failed", "failed"), ("Refused files", "refused")):
        chosen = [row for row in rows if key in row]
        if chosen:
            lines += ["", f"## {title}", "", "| file | reason |", "|---|---|"]
            lines += [f"| {_label(row)} | {row[key].replace('|', '/')} |" for row in chosen]
    return "\n".join(lines) + "\n"


def _label(row: Mapping[str, Any]) -> str:
    return f"{row['name']}{'' if row['simulator'] == 'mujoco' else ' on ' + row['simulator']}"


def _row(row: Mapping[str, Any]) -> str:
    gripper = "one jaw" if row["one_jaw"] else f"{row['drives']} drive{'s' * (row['drives'] > 1)}"
    low, high = row["gap_mm"]
    cells = [
        _label(row),
        row["maker"],
        f"{row['axes']}{' (free yaw)' * row['radial']}",
        gripper,
        f"{low:.0f}–{high:.0f} mm",
        f"{row['object_mm']:.0f} mm",
        f"{row['area_m']:.2f} m",
        f"{row['tolerance_mm']:.0f} mm",
        row["steps"],
        f"{row['derive_cpu_s']:.0f} s{' (missed)' * (row['derive_cpu_s'] > LONGEST)}" if "derive_cpu_s" in row else "",
        f"{row['reach']:.0%}",
        f"{row['expert']:.1%}{' (missed)' * fails(row)}",
        row["episodes"],
        f"{row['trained']:.1%}" if "trained" in row else "",
        *(_share(row.get(task.lower(), "")) for task in OTHERS),
    ]
    return f"| {' | '.join(map(str, cells))} |"


def _share(value: float | str) -> str:
    return value if isinstance(value, str) and not value else "no" if isinstance(value, str) else f"{value:.0%}"


def fails(row: Mapping[str, Any]) -> bool:
    """Return whether an arm that was not refused misses the goal of the expert, which is one for MuJoCo."""
    has_goal = row["simulator"] == "mujoco" and "refused" not in row and row["name"] not in UNSERVED
    return has_goal and row.get("expert", 0.0) < WANTED


def unforeseen(row: Mapping[str, Any]) -> bool:
    """Return whether a file of the packages was refused without the listed reason, or used although it is listed."""
    name = row["name"]
    if name in LIST["refused"]:
        return LIST["refused"][name] not in row.get("refused", "")
    return name in LIST["packages"] and "refused" in row


def kept_rows(kept: Path = KEPT) -> list[dict[str, Any]]:
    """Return all stored results."""
    return [stored(file, dict) for file in sorted(kept.glob("*.json"))]


def main() -> int:
    """Measure, write the page, and return 1 if an expert succeeds too rarely."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("paths", nargs="*", type=Path, help="files, or folders in which files are searched")
    parser.add_argument("--arg", action="append", default=[], metavar="NAME=VALUE", help="argument of xacro files")
    parser.add_argument("--package", action="append", default=[], metavar="NAME=FOLDER", help="folder of a ROS package")
    parser.add_argument("--checkouts", type=Path, metavar="FOLDER", help="checkouts of public repositories")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="measure only the arms with these words in the name")
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument("--simulator", default="mujoco")
    parser.add_argument("--train", action="store_true", help="also train a policy with DAgger")
    parser.add_argument("--others", action="store_true", help="also let the expert lift, push and stack")
    parser.add_argument("--results", type=Path, default=KEPT, metavar="FOLDER", help="folder of stored results")
    parser.add_argument("--page", type=Path, default=PAGE, metavar="FILE", help="page to write")
    parser.add_argument("--kept", action="store_true", help="measure nothing: write the page from the stored results")
    given = parser.parse_args()
    packages = {name: Path(folder) for name, _, folder in (each.partition("=") for each in given.package)}
    arms = list(named_arms(given.paths, dict(each.split("=", 1) for each in given.arg), packages))
    if not given.paths:
        arms += package_arms()
    if given.checkouts:
        arms += public_arms(given.checkouts)
    for arm in () if given.kept else arms:
        if not given.only or any(word in arm.name for word in given.only):
            measure(arm, given.episodes, given.simulator, given.train, given.results, given.others)
    rows = kept_rows(given.results)
    given.page.write_text(report(rows), "utf-8")
    return int(any(fails(row) or unforeseen(row) for row in rows))


if __name__ == "__main__":
    sys.exit(main())
