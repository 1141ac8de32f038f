"""The page of what works with ROS 1 is what the tests say that they show."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))

from generate.ros_features import BEHIND, FEATURES, LIMITS, MarkerError, page, read_marks  # noqa: E402

SIMULATORS = {"mujoco", "pybullet", "gazebo"}


def test_each_row_of_the_page_names_tests_that_exist() -> None:
    row, file, found = "", Path(), defaultdict(list)
    for line in page().splitlines():
        start = re.match(r"   \* - (.+)", line)
        named = re.search(r"\| ``(test_\w+\.py)``$", line)
        test = re.search(r"\|   (\w.*)$", line)
        if start:
            row = start[1].replace("\\_", "_")
        elif named:
            (file,) = ROOT.glob(f"plugins/*/tests/{named[1]}")
        elif test:
            name = f"test_{test[1].replace(' ', '_')}"
            assert re.search(rf"^def {name}\(", file.read_text("utf-8"), re.MULTILINE), f"{file}: {name}"
            found[row].append(name)
    known = {name for group in FEATURES.values() for name in group} | set(LIMITS)
    assert {"laser scans", "RViz", "launch files", "commanders of MoveIt", *LIMITS} <= set(found)
    assert set(found) <= known


def test_a_capability_without_a_test_is_left_out() -> None:
    marks = [mark for mark in read_marks() if mark.name == "laser scans"]
    text = page(marks)
    assert "laser scans" in text
    assert "controller manager" not in text
    assert "What does not work" not in text


@pytest.mark.parametrize(
    ("decorator", "message"),
    [
        ('("laser scan", "mujoco")', "'laser scan' is not listed in ros_features.py. Did you mean 'laser scans'"),
        ('("laser scans", "mojoco")', "'mojoco' is not listed in ros_features.py. Did you mean 'mujoco'"),
        ('("laser scans")', f"name what stands behind it: {', '.join(BEHIND)}"),
        ('("laser scans", "mujoco", works=False)', "'laser scans' is not listed"),
        ('("laser scans", "mujoco", work=False)', "does not know the argument 'work'"),
        ("(NAME, BEHIND)", "as literals"),
        ("()", "as literals"),
        ("", "as a decorator of a test function"),
    ],
)
def test_a_wrong_marker_is_an_error_that_names_its_line(decorator: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "tests").mkdir()
    mark = f"@pytest.mark.ros_feature{decorator}"
    (tmp_path / "tests" / "test_x.py").write_text(f"import pytest\n\n\n{mark}\ndef test_x() -> None: ...\n")
    with pytest.raises(MarkerError) as caught:
        read_marks(tmp_path)
    assert re.search(r"test_x\.py:4: ", str(caught.value))
    assert message in str(caught.value)


@pytest.mark.slow
def test_the_simulators_of_a_marker_are_those_that_the_test_runs_on() -> None:
    """A marked test with a parameter for the simulator names exactly the simulators that pytest runs it on."""
    marks = read_marks()
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "--exhaustive", "-m", "ros_feature"]
    done = subprocess.run([*command, *sorted({mark.file for mark in marks})], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    runs: dict[tuple[str, str], set[str]] = defaultdict(set)
    for line in done.stdout.splitlines():
        item = re.fullmatch(r"(\S+\.py)::(\w+)(?:\[(.*)\])?", line)
        if item:
            runs[item[1], item[2]] |= SIMULATORS & set((item[3] or "").split("-"))
    assert {(mark.file, mark.test) for mark in marks} == set(runs)
    wrong = {}
    for mark in marks:
        simulators = runs[mark.file, mark.test]
        if simulators and mark.works and set(mark.behind) & SIMULATORS != simulators:
            wrong[mark.test] = mark.behind, simulators
    assert wrong == {}
