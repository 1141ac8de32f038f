"""Faults in a plugin, on modules that are written for the test."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from frobs_core.testing import Check, check_plugin, pytest_checks

SOUND = """
from frobs_core.hookspecs import hookimpl
from frobs_core.specs import AlgorithmRecord, EnvironmentRecord, RobotRecord, TaskRecord

@hookimpl
def frobs_robots():
    return [RobotRecord(name="kit_robot", summary="a robot", entry_point="{module}_parts:ROBOT", install_hint="pip install kit")]

@hookimpl
def frobs_tasks():
    reach = EnvironmentRecord(id="kit/Reach-v0", summary="a reach", robot="kit_robot",
                              controller="joint_delta_position", max_episode_steps=50)
    return [TaskRecord(name="kit_task", summary="a task", entry_point="{module}_parts:TASK", install_hint="pip install kit",
                       environments=(reach,))]

@hookimpl
def frobs_algorithms():
    return [AlgorithmRecord(name="kit_algorithm", summary="learns", entry_point="{module}_parts:ALGORITHM",
                            install_hint="pip install kit", tuned={{"kit/Reach-v0": "frobs_core:errors.py"}})]
"""
PARTS = """
from frobs_core.interfaces import Robot
from frobs_tasks_reach.reach import Reach as TASK
from frobs_algos_sb3.ppo import PPO as ALGORITHM
ROBOT = Robot(model="arm.urdf")
"""
EMPTY = """
from frobs_core.hookspecs import hookimpl

@hookimpl
def frobs_robots():
    return []
"""
FAULTS: dict[str, tuple[str, Callable[[str], str], str]] = {
    "broken": ("loads", lambda text: text + "\n1 / 0\n", "ZeroDivisionError"),
    "nothing_offered": ("loads", lambda _: EMPTY, "offers no record"),
    "imports_torch": ("import_is_cheap", lambda text: "import torch\n" + text, "imports torch"),
    "prints": ("import_is_cheap", lambda text: text + "\nprint('hello')\n", "prints: hello"),
    "changes_the_folder": ("import_is_cheap", lambda text: "import os; os.chdir('/')\n" + text, "working directory"),
    "changes_the_environment": (
        "import_is_cheap",
        lambda text: "import os; os.environ['A'] = '1'\n" + text,
        "environment",
    ),
    "seeds_everyone": ("import_is_cheap", lambda text: "import random; random.seed(0)\n" + text, "random state"),
    "silences_warnings": (
        "import_is_cheap",
        lambda text: "import warnings; warnings.simplefilter('ignore')\n" + text,
        "warning filters",
    ),
    "entry_point_of_nothing": ("entry_points_load", lambda text: text.replace(":ROBOT", ":ROBOTS"), "ROBOTS"),
    "entry_point_of_another_kind": (
        "entry_points_load",
        lambda text: text.replace(":TASK", ":ALGORITHM"),
        "no subclass of Task",
    ),
    "taken_name": (
        "names_are_free",
        lambda text: text.replace('name="kit_robot"', 'name="irb120"'),
        "frobs-robots-abb",
    ),
    "no_summary": ("summaries_are_one_line", lambda text: text.replace('"a task"', '""'), "has no summary"),
    "two_lines": ("summaries_are_one_line", lambda text: text.replace('"a task"', '"a\\ntask"'), "not one short line"),
    "no_install_hint": ("summaries_are_one_line", lambda text: text.replace("pip install kit", ""), "install_hint"),
    "id_without_version": (
        "environments_are_complete",
        lambda text: text.replace("Reach-v0", "Reach"),
        "namespace/Name-v0",
    ),
    "unknown_controller": (
        "environments_are_complete",
        lambda text: text.replace("joint_delta_position", "magic"),
        "magic",
    ),
    "tuned_file_missing": (
        "tuned_settings_exist",
        lambda text: text.replace("errors.py", "tuned.yaml"),
        "no such file",
    ),
}


@pytest.fixture
def install(
    isolated_plugins: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., list[Check]]]:
    module = f"kit_plugin_{tmp_path.name}"

    def write(change: Callable[[str], str] = str) -> list[Check]:
        (tmp_path / f"{module}.py").write_text(change(SOUND.format(module=module)))
        (tmp_path / f"{module}_parts.py").write_text(PARTS)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))
        monkeypatch.setenv("FROBS_STRICT_PLUGINS", "0")
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr("frobs_core.testing.fixtures.Plugins", _forgiving)
        isolated_plugins(installed=True, kit=module)
        return check_plugin("kit")

    yield write
    for name in (module, f"{module}_parts"):
        sys.modules.pop(name, None)


def _forgiving(found: Any, **_: Any) -> Any:
    from frobs_core.plugins import Plugins

    return Plugins(found, strict=False, disabled=())


def test_a_sound_plugin_passes(install: Callable[..., list[Check]]) -> None:
    for check in install():
        assert check.run() is None, check.name


@pytest.mark.parametrize(("check", "change", "told"), FAULTS.values(), ids=FAULTS)
def test_the_kit_catches(
    install: Callable[..., list[Check]], monkeypatch: pytest.MonkeyPatch, check: str, change: Any, told: str
) -> None:
    found = next(c for c in install(lambda text: "#\n" + change(text)) if c.name == check)
    with pytest.raises(Exception, match=told):
        found.run()


test_the_reach_plugin_passes = pytest_checks(check_plugin("tasks_reach"), allow_hollow=False)


def test_an_unknown_plugin_fails() -> None:
    with pytest.raises(Exception, match="no plugin is named 'no_such_plugin'"):
        check_plugin("no_such_plugin")[0].run()
