"""The sample of slow tests."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

CONFTEST = Path(__file__).parents[1] / "conftest.py"
_spec = importlib.util.spec_from_file_location("root_conftest", CONFTEST)
sampling = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(sampling)

CASES = """
import pytest

@pytest.mark.slow
@pytest.mark.parametrize("case", range(16))
def test_slow(case):
    pass

@pytest.mark.slow(every=3)
@pytest.mark.parametrize("case", range(16, 28))
def test_third(case):
    pass

def test_plain():
    pass
"""


def test_the_environment_variable_has_priority_over_the_commit():
    assert [sampling.choose_sample({"FROBS_SAMPLE": str(i)}, "abcdef0123") for i in range(8)] == list(range(8))


def test_successive_commits_choose_among_all_eighths():
    assert {sampling.choose_sample({}, f"{i:08x}{'f' * 32}") for i in range(8)} == set(range(8))


def test_the_same_commit_chooses_the_same_eighth():
    assert sampling.choose_sample({}, "25effe8d0b") == sampling.choose_sample({"FROBS_SAMPLE": ""}, "25effe8d0b")


def test_the_first_eighth_is_chosen_without_a_commit():
    assert sampling.choose_sample({}, "") == 0


@pytest.mark.parametrize("value", ["8", "-1", "all", "1.0", " 1"])
def test_an_unusable_sample_is_an_error_that_names_the_range(value):
    with pytest.raises(pytest.UsageError, match="from 0 to 7"):
        sampling.choose_sample({"FROBS_SAMPLE": value}, "")


@pytest.mark.parametrize("every", [3, 8])
def test_the_samples_contain_each_case_once(every):
    for index in range(17):
        assert sum(sampling.is_sampled("test_a.py::test_b", index, sample, every) for sample in range(every)) == 1


def test_functions_with_one_case_are_distributed_over_the_samples():
    count = [sum(sampling.is_sampled(f"test_{name}", 0, sample) for name in range(400)) for sample in range(8)]
    assert min(count) > 20


def run(folder: Path, *options: str, **environment: str) -> tuple[list[int], str]:
    """Run 16 + 12 slow cases in a folder outside any repository; return the cases that ran, and the output."""
    (folder / "conftest.py").write_text(CONFTEST.read_text("utf-8"), encoding="utf-8")
    (folder / "test_cases.py").write_text(CASES, encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\nmarkers = slow\n", encoding="utf-8")
    inherited = {key: value for key, value in os.environ.items() if not key.startswith(("PYTEST", "FROBS_SAMPLE"))}
    inherited["PYTHONPATH"] = str(CONFTEST.parent / "tests")
    command = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", *options]
    done = subprocess.run(command, cwd=folder, env={**inherited, **environment}, text=True, capture_output=True)
    assert done.returncode == 0, done.stdout + done.stderr
    passed = {int(a or b) for a, b in re.findall(r"\[(\d+)\] PASSED|PASSED \S+\[(\d+)\]", done.stdout)}
    return sorted(passed), done.stdout


@pytest.mark.parametrize(
    "options",
    [pytest.param((), id="one process"), pytest.param(("-n", "2"), id="two workers", marks=pytest.mark.slow)],
)
def test_a_run_selects_its_sample_and_shows_how_to_repeat_it(tmp_path, options):
    cases, output = run(tmp_path, *options, FROBS_SAMPLE="1")
    assert cases[:2] == [7, 15]
    assert cases[2:] == [16 + i for i in range(12) if sampling.is_sampled("test_cases.py::test_third", i, 1, 3)]
    assert "sample 2 of 8 of slow tests; FROBS_SAMPLE=1 repeats it, --exhaustive runs all" in output


def test_an_exhaustive_run_selects_every_case(tmp_path):
    assert run(tmp_path, "--exhaustive")[0] == list(range(28))


def test_a_test_that_is_named_runs_in_any_sample(tmp_path):
    for sample in "01":
        assert run(tmp_path, "test_cases.py::test_third", FROBS_SAMPLE=sample)[0] == list(range(16, 28))


@pytest.mark.slow
def test_all_workers_use_the_sample_of_the_controller(tmp_path):
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(tmp_path)]
    subprocess.run([*git, "init", "-q"], check=True)
    subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "first"], check=True)
    commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, text=True, capture_output=True).stdout
    sample = sampling.choose_sample({}, commit)
    cases, output = run(tmp_path, "-n", "2")
    assert f"FROBS_SAMPLE={sample} " in output
    function = "test_cases.py::test_slow"
    assert cases[:2] == [index for index in range(16) if sampling.is_sampled(function, index, sample)]
