"""The marks of tests that need optional parts of a machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CASES = """
import pytest

@pytest.mark.needs("missing_module")
def test_true_mark():
    import missing_module

@pytest.mark.needs("missing_module")
def test_false_mark():
    pass

@pytest.mark.parametrize("simulator", ["missing_simulator", "pybullet"])
def test_by_parameter(simulator, request):
    assert (simulator == "pybullet") is (request.node.get_closest_marker("needs") is not None)

def test_by_fixture(ros, request):
    assert request.node.get_closest_marker("needs").args == ("ros",)

@pytest.fixture
def ros():
    pass

def test_plain():
    pass

def test_skipped_without_a_mark():
    pytest.skip("xterm is not installed")

def test_skipped_by_the_kit():
    pytest.skip("not applicable: it draws nothing")
"""


@pytest.fixture
def run(tmp_path: Path):
    (tmp_path / "test_cases.py").write_text(CASES)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = needs\n")

    def start(*options: str, **variables: str) -> dict[str, str]:
        code = (
            "import sys, pytest, optional_parts\n"
            "optional_parts.PARTS = {'ros': (lambda: True, 'ROS'), 'pybullet': (lambda: True, 'PyBullet')}\n"
            "sys.exit(pytest.main(['-p', 'no:cacheprovider', '-p', 'optional_parts', '-rA', '-q', *sys.argv[1:]]))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, *options],
            cwd=tmp_path,
            env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(Path(__file__).parent), **variables},
            text=True,
            capture_output=True,
        )
        words = [
            line.split() for line in done.stdout.splitlines() if line.startswith(("PASSED", "FAILED", "ERROR", "XFAIL"))
        ]
        return {line[1].partition("::")[2]: line[0] for line in words}

    return start


def test_a_test_whose_part_is_missing_is_skipped(run):
    outcomes = run()
    assert "test_true_mark" not in outcomes
    assert "test_false_mark" not in outcomes
    assert outcomes["test_plain"] == "PASSED"


def test_a_required_part_that_is_missing_is_a_failure(run):
    assert run(FROBS_REQUIRE_PARTS="all")["test_true_mark"] == "ERROR"
    assert run(FROBS_REQUIRE_PARTS="ros missing_module")["test_true_mark"] == "ERROR"
    assert "test_true_mark" not in run(FROBS_REQUIRE_PARTS="ros")


def test_a_test_that_needs_nothing_of_what_it_names_is_found(run):
    outcomes = run("--prove-needs")
    assert outcomes["test_true_mark"] == "XFAIL"
    assert outcomes["test_false_mark"] == "FAILED"
    assert outcomes["test_plain"] == "PASSED"


def test_a_skip_without_a_mark_is_a_failure(run):
    outcomes = run()
    assert outcomes["test_skipped_without_a_mark"] == "FAILED"
    assert "test_skipped_by_the_kit" not in outcomes


def test_fixtures_and_parameters_mark_their_tests(run):
    outcomes = run()
    assert outcomes["test_by_fixture"] == "PASSED"
    assert outcomes["test_by_parameter[pybullet]"] == "PASSED"
    assert outcomes["test_by_parameter[missing_simulator]"] == "PASSED"


def test_what_has_passed_is_left_out_of_another_run(run, tmp_path: Path):
    run("--passed-to", "passed.txt")
    passed = (tmp_path / "passed.txt").read_text().split()
    assert "test_cases.py::test_plain" in passed
    assert "test_cases.py::test_true_mark" not in passed
    assert set(run("--skip-passed", "passed.txt")) == {"test_skipped_without_a_mark"}
