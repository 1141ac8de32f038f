"""Planting a fault in the source of a module, and asking the kit, in a process that is forked for it.

The module itself is not touched: the process that is forked imports a changed copy of it, before anything has imported
the sound one.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import Any

from frobs_core.description import EndEffector, Robot
from frobs_devkit.testing import Check, check_controller, check_env, check_robot, check_simulator, check_task

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT))  # for templates
SECONDS = 300.0
"""After which a process is ended: a fault that makes a check hang is caught by it."""


TASKS = {
    "observation": "reach",
    "task": "reach",
    "goal": "reach_goal",
    "goal_task": "reach_goal",
    "dynamic": "reach_dynamic",
    "motion": "reach_dynamic",
}
"""Task that is checked for a fault in a module, by the module's name."""

TOOL = Robot(
    model=str(ROOT / "tests" / "contracts" / "fingers.urdf"),
    home={"left": 0.04, "right": 0.03},
    end_effectors={
        "fingers": EndEffector(tcp="tcp", open={"left": 0.04, "right": 0.04}, closed={"left": 0.0, "right": 0.0})
    },
)
"""A gripper that the kit attaches to an arm."""

_ARM = "frobs_robots_abb:models/irb120.urdf.xacro"
GROUPED: Mapping[str, Any] = {
    "robot": Robot(
        model=_ARM,
        home={"joint_5": 0.5},
        tcp="tool0",
        groups={
            "arm": ("joint_1", "joint_2", "joint_3"),
            "roll": ("joint_4",),
            "free": ("joint_5",),
            "wrist": ("joint_6",),
        },
    ),
    "controller": {"arm": "joint_delta_position", "roll": "joint_velocity", "wrist": "joint_delta_position"},
}
"""Keywords of an environment whose robot has three controllers, and a joint without any."""

TWO_ROBOTS: Mapping[str, Any] = {
    "robots": {
        "robot": {"robot": "irb120", "sensors": {"imu": {"type": "imu", "frame": "link_6", "noise": 0.01}}},
        "other": {"robot": "irb140", "pose": {"pos": [1.5, 0.0, 0.0]}},
    },
    "controller": "joint_delta_position",
    "observations": {
        "last": {"type": "previous_action"},
        "efforts": {"type": "joint_efforts", "robot": "other"},
        "imu": {"type": "sensor", "sensor": "imu"},
    },
}
"""Keywords of an environment with two robots and terms that the user adds."""

_SHAPES = ("actions_move_their_joints", "terms_fill_their_columns")
PARTS: Mapping[str, Sequence[str]] = {
    "control": (*_SHAPES, "snapshot_continues", "reset_forgets_history"),
    "joint_group": _SHAPES,
    "mount": _SHAPES,
    "observation": _SHAPES,
    "step_context": (*_SHAPES, "reset_forgets_history", "observation_elements_vary"),
}
"""Checks of environments that look at the contract of a module of the core, by the name of the module."""


@dataclass(frozen=True)
class Fault:
    """A change of one module.

    Attributes:
        name: What is wrong.
        module: That is changed.
        source: Its text with the fault.
        where: Line, and what stood there and stands there now.
    """

    name: str
    module: str
    source: str
    where: str


def source_of(module: str) -> str:
    """Return the text of a module, without importing it."""
    return path_of(module).read_text("utf-8")


def path_of(module: str) -> Path:
    """Return the file of a module, without importing it."""
    package, _, name = module.rpartition(".")
    top = package.partition(".")[0]
    folder = f"plugins/{top.replace('_', '-')}/src"
    if top in ("frobs_core", "templates"):
        folder = ""
    elif top.startswith("by_"):
        folder = "tests/planted_faults"
    return ROOT / folder / package.replace(".", "/") / f"{name}.py"


def replaced(name: str, module: str, old: str, new: str) -> Fault:
    """Return a fault that is written by hand: a text that stands once in the module, and another in its place."""
    source = source_of(module)
    assert source.count(old) == 1, f"{name}: '{old}' stands {source.count(old)} times in {module}"
    line = source[: source.index(old)].count("\n") + 1
    return Fault(name, module, source.replace(old, new), f"line {line}: `{_short(old)}` → `{_short(new)}`")


def checks_for(module: str) -> Iterator[Check]:
    """Yield what the kit asks of what a module is part of: the quick first, and what needs no picture."""
    package, _, name = module.rpartition(".")
    if package.startswith("by_"):
        import outsider  # which imports this module

        yield from outsider.checks_for(module)
        return
    name = "joint_delta_position" if name == "commanded_positions" else name  # its base class
    if package == "templates" or name == "pacing":
        yield from check_simulator(importlib.import_module("templates.my_paced_simulator").RECORD)
        return
    if name in PARTS:
        yield from check_controller("joint_delta_position")
        yield from check_controller("joint_position")
        yield from check_robot(TOOL, [])
        for keywords in (GROUPED, TWO_ROBOTS):
            yield from _only(PARTS[name], check_env("frobs/Env-v0", task="reach", **keywords))
    elif name in ("controller", "discrete"):
        yield from check_controller("discrete")
    elif package in ("frobs_sim_mujoco", "frobs_core.contracts", "frobs_core.description") and name not in TASKS:
        yield from _without_pictures(check_simulator("mujoco"))
        yield from check_robot("irb120", ["mujoco"])
    elif package == "frobs_controllers":
        yield from check_controller(name)
        yield from check_controller(name, robot=None if name == "differential_drive" else "irb120")
    if package == "frobs_tasks_reach" or name in TASKS:
        task = TASKS.get(name, "reach")
        yield from check_task(task)
        if task == "reach_goal":
            yield from check_task(task, reward_type="dense")
        if name == "terms":  # which all of them share
            yield from check_task("reach_goal")
    else:
        yield from _without_pictures(check_env("frobs/Irb120Reach-v0", **_controller(package, name)))


def ask(fault: Fault) -> str | None:
    """Return the name of the first check that catches a fault, ``"import"`` or ``"hangs"``; None: it survives."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.close(reader)
        _child(fault, writer)
    os.close(writer)
    deadline, told = time.monotonic() + SECONDS, b""
    while time.monotonic() < deadline:
        if select.select([reader], [], [], max(0.0, deadline - time.monotonic()))[0]:
            part = os.read(reader, 4096)
            told += part
            if not part:
                break
    os.close(reader)
    os.kill(child, signal.SIGKILL) if time.monotonic() >= deadline else None
    os.waitpid(child, 0)
    if time.monotonic() >= deadline:
        return "hangs"
    answer = json.loads(told) if told else "crash"
    return answer if answer is None else str(answer)


def _child(fault: Fault, writer: int) -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    answer: str | None = "import"
    try:
        if fault.module in sys.modules:  # a module of the core, which the kit imports
            _replace(fault)
        else:
            sys.meta_path.insert(0, _Planter(fault))
        answer = _first_failure(checks_for(fault.module))
    finally:
        os.write(writer, json.dumps(answer).encode())
        os._exit(0)


def _replace(fault: Fault) -> None:
    """Give the classes of a module that is imported already the methods of its changed source."""
    module = sys.modules[fault.module]
    changed = dict(vars(module))
    exec(compile(fault.source, module.__file__ or "", "exec"), changed)
    for name, cls in vars(module).items():
        if isinstance(cls, type) and cls.__module__ == fault.module:
            for attribute, value in vars(changed[name]).items():
                if attribute == "__init_subclass__":  # its super() belongs to the changed class
                    continue
                if isinstance(value, FunctionType | property | staticmethod | classmethod):
                    setattr(cls, attribute, value)


def _first_failure(checks: Iterator[Check]) -> str | None:
    from frobs_devkit.testing import run_checks
    from frobs_devkit.testing.environment import vector

    vector.STEPS = 110  # the first end of an episode, and some steps of the next
    for check in checks:
        if run_checks([check]).failed:
            return check.name
    return None


def _without_pictures(checks: list[Check]) -> Iterator[Check]:
    slow = ("cameras_see", "pictures_are_true", "render_draws", "stable_baselines3_checker", "fresh_process")
    yield from (check for check in checks if check.name not in slow)


def _only(names: Sequence[str], checks: list[Check]) -> Iterator[Check]:
    yield from (check for check in checks if check.name in names)


def _controller(package: str, name: str) -> dict[str, str]:
    return {"controller": name} if package == "frobs_controllers" and name != "differential_drive" else {}


def _short(text: str) -> str:
    return " ".join(text.split())[:100]


class _Planter(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports the changed source in the place of one module."""

    def __init__(self, fault: Fault) -> None:
        self._fault = fault
        self.exec_module: Callable[..., None] = self._execute  # type: ignore[method-assign]

    def find_spec(self, name: str, path: object, target: object = None) -> importlib.machinery.ModuleSpec | None:
        """Answer for that module alone."""
        if name != self._fault.module:
            return None
        spec = importlib.util.spec_from_loader(name, self, origin=str(path_of(name)))
        if spec is not None:
            spec.has_location = True  # so that the module has a __file__
        return spec

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> None:
        """Leave it to Python."""

    def _execute(self, module: object) -> None:
        vars(module)["__file__"] = str(path_of(self._fault.module))
        exec(compile(self._fault.source, f"{self._fault.module} (changed)", "exec"), vars(module))
