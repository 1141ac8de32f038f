"""Faults in a plugin, on distributions that are written for the test: each is caught by one check, and by no other."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.metadata import PathDistribution, distributions
from pathlib import Path

import pytest

from frobs_core import plugins
from frobs_devkit.testing import Check, check_plugin, pytest_checks, run_checks
from frobs_devkit.testing.plugin import CHECKS

SOUND = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord, EnvironmentRecord, RobotRecord, TaskRecord

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
                            install_hint="pip install kit", tuned={{"kit/Reach-v0": "frobs_core:util/errors.py"}})]
"""
PARTS = """
from frobs_core.description import Robot
from frobs_tasks_reach.reach import Reach as TASK
from frobs_algos_sb3.ppo import PPO as ALGORITHM
ROBOT = Robot(model="arm.urdf")
"""
EMPTY = """
from frobs_core.plugins.hooks import hookimpl

@hookimpl
def frobs_robots():
    return []
"""
REQUIRES = "Requires-Dist: frobs-core>=0.3,<0.4\n"


def change(old: str, new: str) -> Callable[[str], str]:
    return lambda text: text.replace(old, new)


def add(line: str) -> Callable[[str], str]:
    """Do something when the plugin is imported, in the process of the probe alone: not to the tests."""
    return lambda text: f"import os as _os\nif _os.environ.get('FROBS_NO_PLUGINS'): {line}\n{text}"


FAULTS: dict[str, tuple[str, Callable[[str], str], str]] = {
    "nothing_offered": ("loads", lambda _: EMPTY, "provides no records"),
    "imports_an_engine": ("import_is_cheap", add("import rospy"), "imports rospy"),
    "takes_long": ("import_is_cheap", add("import time; time.sleep(6)"), "which slows down every command"),
    "id_of_another": ("environments_are_complete", change("kit/Reach-v0", "frobs/Irb120Reach-v0"), "is provided by"),
    "prints": ("import_is_silent", add("print('hello')"), "stdout: the plugin prints during its import: hello"),
    "complains": (
        "import_is_silent",
        add("import sys; sys.stderr.write('hello')"),
        "stderr: the plugin prints during its import: hello",
    ),
    "changes_the_folder": ("import_changes_nothing", add("import os; os.chdir('/')"), "working directory"),
    "changes_the_folder_and_back": (
        "import_changes_nothing",
        add("import os; here = os.getcwd(); os.chdir('/'); os.chdir(here)"),
        "working directory",
    ),
    "changes_the_environment": ("import_changes_nothing", add("import os; os.environ['A'] = '1'"), "environment"),
    "seeds_everyone": ("import_changes_nothing", add("import random; random.seed(0)"), "random state"),
    "seeds_numpy": ("import_changes_nothing", add("import numpy; numpy.random.seed(0)"), "random state"),
    "silences_warnings": (
        "import_changes_nothing",
        add("import warnings; warnings.simplefilter('ignore')"),
        "warning filters",
    ),
    "takes_ctrl_c": (
        "import_changes_nothing",
        add("import signal; signal.signal(signal.SIGINT, print)"),
        "signal handlers",
    ),
    "replaces_stdout": (
        "import_changes_nothing",
        add("import io, sys; sys.stdout = io.StringIO()"),
        "standard streams",
    ),
    "leaves_a_thread": (
        "import_changes_nothing",
        add("import threading, time; threading.Thread(target=time.sleep, args=(60,)).start()"),
        "threads",
    ),
    "registers_by_hand": (
        "import_changes_nothing",
        add("import gymnasium; gymnasium.register('kit/Mine-v0', 'a:B')"),
        "Gymnasium's registry",
    ),
    "starts_a_program": (
        "import_changes_nothing",
        add("import subprocess; subprocess.run(['true'])"),
        "it opens another program",
    ),
    "uses_what_goes": (
        "nothing_deprecated_is_used",
        add("import warnings; warnings.warn('it goes', DeprecationWarning)"),
        "DeprecationWarning: it goes",
    ),
    "entry_point_of_nothing": ("entry_points_load", change(":ROBOT", ":ROBOTS"), "ROBOTS"),
    "entry_point_of_another_kind": ("entry_points_load", change(":TASK", ":ALGORITHM"), "not a subclass of Task"),
    "taken_name": ("names_are_free", change('name="kit_algorithm"', 'name="ppo"'), "frobs-algos-sb3"),
    "no_summary": ("summaries_are_one_line", change('"a task"', '""'), "has no summary"),
    "two_lines": (
        "summaries_are_one_line",
        change('"a task"', '"a\\ntask"'),
        "must be a single line of at most 120 characters",
    ),
    "no_install_hint": ("summaries_are_one_line", change("pip install kit", ""), "install_hint"),
    "id_without_version": ("environments_are_complete", change("Reach-v0", "Reach"), "namespace/Name-v0"),
    "unknown_controller": ("environments_are_complete", change("joint_delta_position", "magic"), "magic"),
    "policy_missing": (
        "pretrained_policies_fit",
        change("max_episode_steps=50", "max_episode_steps=50, pretrained='frobs_core:none.frobs'"),
        "cannot be read",
    ),
    "policy_is_something_else": (
        "pretrained_policies_fit",
        change("max_episode_steps=50", "max_episode_steps=50, pretrained='frobs_core:util/errors.py'"),
        "not a policy bundle",
    ),
    "tuned_file_missing": ("tuned_settings_exist", change("errors.py", "tuned.yaml"), "does not contain this file"),
}
REQUIREMENTS: dict[str, tuple[str, str, str]] = {
    "requirement_missing": (
        "requirements_are_met",
        REQUIRES + "Requires-Dist: kit-needs-this>=2; python_version > '3'\n",
        "pip install 'kit-needs-this>=2'",
    ),
    "requirement_too_old": ("requirements_are_met", REQUIRES + "Requires-Dist: numpy>=99\n", "--upgrade 'numpy>=99'"),
    "core_not_stated": ("core_versions_are_stated", "Requires-Dist: numpy\n", "without an upper bound"),
    "core_without_an_end": ("core_versions_are_stated", "Requires-Dist: frobs-core>=0.1\n", "without an upper bound"),
}
INSEPARABLE: dict[str, str] = {}

FAST = ("nothing_offered", "prints", "seeds_everyone", "taken_name")
"""Faults that 'make test' tries; the others start a process each, too."""

Install = Callable[..., list[Check]]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Install a distribution beside the real ones and return its checks."""
    module = f"kit_plugin_{tmp_path.name}"
    info = tmp_path / "kit_plugin-1.0.dist-info"
    found = [d for d in distributions() if d.name.startswith("frobs-")]

    def write(change: Callable[[str], str] = str, requires: str = REQUIRES) -> list[Check]:
        (tmp_path / f"{module}.py").write_text(change(SOUND.format(module=module)))
        (tmp_path / f"{module}_parts.py").write_text(PARTS)
        (tmp_path / "rospy.py").write_text("")
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: kit-plugin\nVersion: 1.0\n{requires}")
        (info / "entry_points.txt").write_text(f"[frobs]\nkit = {module}\n")
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, "rospy", raising=False)  # the real one returns after the test
        monkeypatch.chdir(tmp_path)
        stack.enter_context(
            plugins.isolated(plugins.Plugins([*found, PathDistribution(info)], strict=False, disabled=()))
        )
        return check_plugin("kit")

    with ExitStack() as stack:
        yield write
    for name in (module, f"{module}_parts", "rospy"):
        sys.modules.pop(name, None)


def test_a_sound_plugin_passes(install: Install) -> None:
    for check in install():
        check.run()


@pytest.mark.parametrize(
    ("check", "change", "told"),
    [pytest.param(*fault, id=id, marks=[] if id in FAST else pytest.mark.slow) for id, fault in FAULTS.items()],
)
def test_one_check_catches_it_and_no_other(
    install: Install, check: str, change: Callable[[str], str], told: str
) -> None:
    report = run_checks(install(change))
    assert [result.name for result in report.failed] == [check]
    assert told in report.failed[0].message


@pytest.mark.parametrize(("check", "requires", "told"), REQUIREMENTS.values(), ids=REQUIREMENTS)
def test_one_check_catches_what_the_metadata_says(install: Install, check: str, requires: str, told: str) -> None:
    report = run_checks(install(requires=requires))
    assert [result.name for result in report.failed] == [check]
    assert told in report.failed[0].message


def test_every_check_has_a_fault_that_no_other_catches() -> None:
    caught = {check for check, _, _ in (*FAULTS.values(), *REQUIREMENTS.values())}
    assert caught | INSEPARABLE.keys() == {check.__name__ for check in CHECKS}


def test_a_broken_plugin_is_one_failure_with_its_cause(install: Install) -> None:
    report = run_checks(install(lambda text: f"1 / 0\n{text}"))
    assert [result.name for result in report.failed] == ["loads"]
    assert "ZeroDivisionError" in report.failed[0].message
    assert "import_is_cheap" in [result.name for result in report.results if result.status == "skipped"]


def test_what_a_plugin_prints_does_not_reach_stdout(install: Install, capsys: pytest.CaptureFixture[str]) -> None:
    install(lambda text: f"print('hello')\n{text}")
    plugins.reports()
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", "hello\n")


test_the_reach_plugin_passes = pytest_checks(check_plugin("tasks_reach"), allow_inconclusive=False)


def test_an_unknown_plugin_fails() -> None:
    with pytest.raises(Exception, match="no plugin is named 'no_such_plugin'"):
        check_plugin("no_such_plugin")[0].run()
