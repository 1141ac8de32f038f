"""The page of what works with ROS 1, read from the marker ``ros_feature`` of the tests that show it.

A test of a capability carries one line: ``@pytest.mark.ros_feature("laser scans", "mujoco", "gazebo")``. The first argument is
a name of :data:`FEATURES`; the others are names of :data:`BEHIND`. With ``works=False`` the test asserts that something is
rejected, and the name is one of :data:`LIMITS`. A test that shows several capabilities carries several lines.
"""

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from generate.rst import code, escape, heading, label, table

ROOT = Path(__file__).parents[2]

BEHIND = {
    "ros": "ROS Noetic of Debian 12",
    "mujoco": "bridge over MuJoCo",
    "pybullet": "bridge over PyBullet",
    "gazebo": "bridge over Gazebo 11",
    "replacement": "replacement of FRobs",
}
"""What can stand behind a capability, in the order of the table."""

FEATURES = {
    "Simulation": (
        "pausing, resuming and stepping",
        "resets of the world and of the time",
        "physics properties",
        "world files",
        "spawning and deleting models",
        "model states",
        "link states and properties",
        "joint properties and model configuration",
        "joint efforts and body wrenches",
        "lights",
        "the clock",
        "the command gz",
    ),
    "Controllers": (
        "controller manager",
        "joint states",
        "position controllers",
        "velocity controllers",
        "effort controllers",
        "trajectory controllers",
        "differential drives",
    ),
    "Sensors and odometry": (
        "laser scans",
        "odometry",
        "cameras",
        "IMU",
        "contact sensors",
        "Gazebo plugins in a URDF",
    ),
    "Tools of ROS": (
        "tf and robot_state_publisher",
        "RViz",
        "rosbag",
        "actionlib",
        "dynamic_reconfigure",
        "launch files",
        "launch files with gazebo_ros and spawn_model",
        "xacro",
        "parameters",
        "nodes",
        "messages of packages that Debian does not have",
    ),
    "MoveIt": ("commanders of MoveIt", "planning scene of MoveIt"),
    "FRobs_RL": (
        "helper functions of FRobs_RL",
        "RobotBasicEnv of FRobs_RL",
        "packages that use FRobs_RL",
    ),
    "Policies": ("policies as nodes",),
    "Network": ("closed to other machines", "clients on other machines", "several masters on one machine"),
}
"""Names of capabilities by section. The page leaves out a capability that no test shows."""

LIMITS = (
    "SDF elements that the bridge does not read",
    "recording, physics other than ode, and enable_ros_network:=false in empty_world.launch",
    "plugins of Gazebo that the bridge does not know",
    "a second simulation on one master",
    "joint properties other than the damping",
    "link states of links that are not a root",
    "gripper commands through MoveIt",
    "policies that see images",
    "images of cameras on the bridge over Gazebo 11",
)
"""Names of what is rejected."""


class MarkerError(Exception):
    """A marker ``ros_feature`` that cannot be read, or that contains an unknown name."""


@dataclass(frozen=True)
class Mark:
    """A marker of one test.

    Attributes:
        name: A name of ``FEATURES`` or ``LIMITS``.
        behind: Names of ``BEHIND``.
        works: Whether the test shows that it works.
        file: The test's file, relative to the repository.
        test: Name of the test function.
    """

    name: str
    behind: tuple[str, ...]
    works: bool
    file: str
    test: str


def read_marks(root: Path = ROOT) -> list[Mark]:
    """Return the markers of all tests below a folder, by file and line.

    Raises:
        MarkerError: A marker is not a decorator of a test function with literal arguments, or contains an unknown name.
    """
    files = sorted([*root.glob("tests/**/test_*.py"), *root.glob("plugins/*/tests/**/test_*.py")])
    return [mark for file in files for mark in _read_file(file, root)]


def _read_file(file: Path, root: Path) -> Iterator[Mark]:
    text = file.read_text("utf-8")
    if "mark.ros_feature" not in text:
        return
    tree = ast.parse(text)
    read = set()
    for function in tree.body:
        if not isinstance(function, ast.FunctionDef) or not function.name.startswith("test_"):
            continue
        for decorator in function.decorator_list:
            if isinstance(decorator, ast.Call) and _is_marker(decorator.func):
                read.add(decorator.func)
                yield _read_call(decorator, file.relative_to(root).as_posix(), function.name)
    for node in ast.walk(tree):
        if _is_marker(node) and node not in read:
            raise MarkerError(f"{file}:{node.lineno}: use ros_feature(…) as a decorator of a test function.")


def _is_marker(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and ast.unparse(node) == "pytest.mark.ros_feature"


def _read_call(call: ast.Call, file: str, test: str) -> Mark:
    where = f"{file}:{call.lineno}"
    try:
        name, *behind = (ast.literal_eval(argument) for argument in call.args)
        keywords = {keyword.arg: ast.literal_eval(keyword.value) for keyword in call.keywords}
    except ValueError as error:
        raise MarkerError(f"{where}: ros_feature takes a name and what stands behind it, as literals.") from error
    works = keywords.pop("works", True)
    if keywords:
        raise MarkerError(f"{where}: ros_feature does not know the argument '{next(iter(keywords))}'; use works=False.")
    _check(name, [each for group in FEATURES.values() for each in group] if works else LIMITS, where)
    if works and not behind:
        raise MarkerError(f"{where}: name what stands behind it: {', '.join(BEHIND)}.")
    for each in behind:
        _check(each, BEHIND, where)
    return Mark(name, tuple(behind), works, file, test)


def _check(name: str, known: Iterable[str], where: str) -> None:
    names = list(known)
    if name not in names:
        close = get_close_matches(name, names, 1)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        raise MarkerError(f"{where}: '{name}' is not listed in {Path(__file__).name}.{hint}")


def page(marks: list[Mark] | None = None) -> str:
    """Return the page of some marks; None: of all tests."""
    marks = read_marks() if marks is None else marks
    text = label("ros-features") + heading("What works with ROS 1")
    text += (
        "Each row is a feature of ROS 1 or of gazebo_ros. The page is generated from the tests of these features, so a "
        "feature without a test does not appear. The ROS master and the clients in these tests are those of ROS Noetic in "
        "Debian 12. The second column names the implementation that responds to them. The bridge over Gazebo 11 runs without "
        "gazebo_ros, which Debian does not provide; no test runs Gazebo with the original gazebo_ros. A replacement is a program "
        "or module of FRobs with the name and the behavior of a ROS package that Debian does not provide.\n\n"
    )
    for group, names in FEATURES.items():
        rows = [row for name in names if (row := _row([mark for mark in marks if mark.works and mark.name == name]))]
        if rows:
            text += heading(group, "-")
            text += table(["feature", "implementation", "tests"], rows, widths="22 22 56")
    limits = [[mark for mark in marks if not mark.works and mark.name == name] for name in LIMITS]
    rows = [(escape(shown[0].name), _tests(shown)) for shown in limits if shown]
    if rows:
        text += heading("What does not work", "-")
        text += "The following features are rejected with a message that names the feature.\n\n"
        text += table(["not supported", "tests of the rejection"], rows, widths="44 56")
    return text


def _row(marks: list[Mark]) -> tuple[str, ...] | None:
    if not marks:
        return None
    behind = [text for name, text in BEHIND.items() if any(name in mark.behind for mark in marks)]
    return escape(marks[0].name), ", ".join(behind), _tests(marks)


def _tests(marks: list[Mark]) -> str:
    """Return the tests by file, each on a line of its own."""
    lines = []
    for file in dict.fromkeys(mark.file for mark in marks):
        lines.append(f"| {code(Path(file).name)}")
        lines += [f"|   {name.replace('_', ' ').strip()}" for name in _names(marks, file)]
    return "\n".join(lines)


def _names(marks: list[Mark], file: str) -> list[str]:
    return [mark.test.removeprefix("test_") for mark in marks if mark.file == file]
