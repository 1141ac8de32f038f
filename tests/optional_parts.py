"""Parts of a machine that ``make test`` does not install, and the tests that need them.

A test that needs such a part is marked ``@pytest.mark.needs("ros")``. The mark takes names of :data:`PARTS` and names of
Python modules; with ``on="mujoco"``, it counts only for the cases of the test with this parameter. Tests get the mark by themselves if they use a fixture of :data:`FIXTURES`, or if they are parametrized
with ``"pybullet"``. Where a part is missing, the test is skipped; with ``FROBS_REQUIRE_PARTS=all`` it fails instead.

Two checks ensure that the marks are true: ``--prove-needs`` also runs the tests whose parts are missing, and reports those
that pass. Without a mark, a test that is skipped because something is missing fails.
"""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
ORIGINALS = ROOT.parent / "shared" / "frobs_rl" / "originals"
_DRAW = (
    "import gymnasium as gym\n"
    "gym.make('frobs_core:frobs/Irb120Reach-v0', render_mode='rgb_array').unwrapped.simulation.render()"
)
_OF_THE_KIT = re.compile(r"(inconclusive|not applicable): |.* failed$")
"""Reasons of the conformance kit, whose checks depend on each other and on what a plugin declares."""


def _programs(*names: str) -> bool:
    return all(map(shutil.which, names))


def _runs(*command: str) -> bool:
    return _programs(command[0]) and subprocess.run(command, capture_output=True).returncode == 0


def _has_ros() -> bool:
    from frobs_ros.ros.environment import find_ros

    return find_ros() is not None


def _has_rosbag() -> bool:
    from frobs_ros.ros.environment import child_variables

    return _has_ros() and shutil.which("rosbag", path=child_variables()["PATH"]) is not None


def _has_state_publisher() -> bool:
    from frobs_ros.errors import RosError
    from frobs_ros.ros.packages import find_node

    try:
        find_node("robot_state_publisher", "robot_state_publisher")
    except RosError:
        return False
    return True


def _has_gazebo() -> bool:
    from frobs_core.util.errors import SimulationError
    from frobs_sim_gazebo.installation import find_gazebo

    try:
        find_gazebo()
    except SimulationError:
        return False
    return True


def _has_page() -> bool:
    built = ROOT / "plugins" / "frobs-view" / "src" / "frobs_view" / "page_files" / "app.js"
    return built.is_file() and (ROOT / "plugins" / "frobs-view" / "page" / "node_modules").is_dir()


def _ros2_imports(*modules: str) -> bool:
    from ros2_wheels import ros2_variables

    variables = ros2_variables()
    command = [sys.executable, "-c", f"import {', '.join(modules)}"]
    return variables is not None and subprocess.run(command, env=variables, capture_output=True).returncode == 0


def _has_ros2() -> bool:
    from ros2_wheels import ros2_variables

    return ros2_variables() is not None


PARTS: Mapping[str, tuple[Callable[[], bool], str]] = {
    "ros": (_has_ros, "ROS 1: apt-get install ros-core"),
    "ros2": (_has_ros2, "ROS 2 in a folder of its own: .ci/ros2.sh"),
    "ros2-control": (
        lambda: _ros2_imports("control_msgs.action", "tf2_msgs.msg"),
        "control_msgs and tf2_msgs, which the wheels of ROS 2 do not contain: a ROS 2 that is installed and sourced",
    ),
    "ros2-dds": (lambda: _ros2_imports("cyclonedds.domain"), "another vendor's DDS beside ROS 2: .ci/ros2.sh"),
    "ros-state-publisher": (_has_state_publisher, "apt-get install ros-robot-state-publisher"),
    "rosbag": (_has_rosbag, "apt-get install python3-rosbag"),
    "rviz": (lambda: _programs("rviz", "Xvfb"), "apt-get install rviz xvfb"),
    "gazebo": (_has_gazebo, "Gazebo 11; see docs/how-to/gazebo.md"),
    "browser": (
        lambda: any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
        "apt-get install chromium",
    ),
    "page": (_has_page, "the files of static pages: make page"),
    "rendering": (lambda: _runs(sys.executable, "-c", _DRAW), "OpenGL: apt-get install libegl1 libgl1-mesa-dri"),
    "xterm": (lambda: _programs("Xvfb", "xterm"), "apt-get install xvfb xterm"),
    "mounts": (lambda: _runs("unshare", "-m", "true"), "the rights to mount a file system"),
    "networks": (
        lambda: _programs("nsenter", "ip") and _runs("unshare", "-n", "true"),
        "the rights to make networks, and apt-get install iproute2",
    ),
    "originals": (ORIGINALS.is_dir, f"the original packages of FRobs_RL in {ORIGINALS}"),
    "vendors": (lambda: bool(os.environ.get("FROBS_VENDOR_MODELS")), "FROBS_VENDOR_MODELS, a folder of checkouts"),
}
"""How to find out whether a part is here, and how to get it."""

OPTIONAL_EVERYWHERE = ("lerobot", "ros2-control", "vendors")
"""Parts that ``FROBS_REQUIRE_PARTS=all`` does not require."""

FIXTURES: Mapping[str, str] = {
    "ros": "ros",
    "ros2": "ros2",
    "legacy_run": "ros",
    "real_gazebo": "gazebo",
    "small_disk": "mounts",
    "machines": "networks",
}
"""Parts that fixtures need, by the name of the fixture."""


@cache
def is_here(part: str) -> bool:
    """Return whether this machine has a part, or a Python module of this name can be imported."""
    if part in PARTS:
        return PARTS[part][0]()
    try:
        importlib.import_module(part)
    except ImportError:  # of the module itself, or of a library that it needs
        return False
    return True


def needs_of(item: pytest.Item) -> list[str]:
    """Return the parts that a test needs."""
    marks = [mark for mark in item.iter_markers("needs") if mark.kwargs.get("on") in (None, *_parameters(item))]
    return sorted({part for mark in marks for part in mark.args})


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that run the tests of a bare machine once, and check the marks."""
    parser.addoption(
        "--prove-needs", action="store_true", help="also run tests whose parts are missing: they must fail"
    )
    parser.addoption("--passed-to", metavar="FILE", help="write the names of the tests that passed")
    parser.addoption("--skip-passed", metavar="FILE", help="leave out the tests that --passed-to has written")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests by their fixtures and parameters, and leave out the tests that have passed."""
    for item in items:
        for part in dict.fromkeys([*_by_fixture(item), *_by_parameter(item)]):
            item.add_marker(pytest.mark.needs(part))
        if config.getoption("--prove-needs") and not all(map(is_here, needs_of(item))):
            item.add_marker(pytest.mark.xfail(strict=True, reason=f"needs {', '.join(needs_of(item))}"))
    if path := config.getoption("--skip-passed"):
        passed = set(Path(path).read_text("utf-8").splitlines())
        left_out = [item for item in items if item.nodeid in passed]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item.nodeid not in passed]


def _by_fixture(item: pytest.Item) -> Iterator[str]:
    for name in getattr(item, "fixturenames", ()):
        if name in FIXTURES:
            yield FIXTURES[name]


def _by_parameter(item: pytest.Item) -> Iterator[str]:
    if "pybullet" in _parameters(item):
        yield "pybullet"


def _parameters(item: pytest.Item) -> list[str]:
    callspec = getattr(item, "callspec", None)
    return [value for value in callspec.params.values() if isinstance(value, str)] if callspec is not None else []


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test whose parts are missing, or fail if they are required."""
    if item.config.getoption("--prove-needs"):
        return
    missing = [part for part in needs_of(item) if not is_here(part)]
    if not missing:
        return
    reason = f"needs {', '.join(PARTS[part][1] if part in PARTS else f'pip install {part}' for part in missing)}"
    required = os.environ.get("FROBS_REQUIRE_PARTS", "")
    if any(part in required.split() or (required == "all" and part not in OPTIONAL_EVERYWHERE) for part in missing):
        pytest.fail(f"FROBS_REQUIRE_PARTS={required}, and the test {reason}", pytrace=False)
    pytest.skip(reason)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Fail a test that is skipped and has no mark: its reader could not know what it needs."""
    report: Any = yield
    if report.skipped and not hasattr(report, "wasxfail") and not needs_of(item):
        reason = str(report.longrepr[2] if isinstance(report.longrepr, Sequence) else report.longrepr)
        if not _OF_THE_KIT.match(reason.removeprefix("Skipped: ")):
            report.outcome = "failed"
            report.longrepr = f"{reason}\nThe test is skipped but not marked: add @pytest.mark.needs(PART)."
    return report


class Passed:
    """Plugin that writes the names of the tests that passed.

    Args:
        path: The file, one name per line.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._passed: dict[str, bool] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Store the outcome of a phase of a test."""
        self._passed[report.nodeid] = self._passed.get(report.nodeid, True) and report.passed

    def pytest_sessionfinish(self) -> None:
        """Write the file."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._path.write_text("".join(f"{name}\n" for name, passed in self._passed.items() if passed), "utf-8")


def pytest_configure(config: pytest.Config) -> None:
    """Write the names of passed tests in the process that sees all reports."""
    path = config.getoption("--passed-to")
    if path and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Passed(Path(path)))
