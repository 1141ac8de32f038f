from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_devkit.scaling import ScalingRanges
from frobs_devkit.scaling.measure import powers_of_two
from frobs_devkit.scaling.processes import measure_cluster, measure_processes
from frobs_train import RunConfig
from frobs_train.runners.runner import load_runner

CONFIG = RunConfig(environment="CartPole-v1", num_envs=4)


def test_sizes_are_powers_of_two_and_the_number_itself() -> None:
    assert [powers_of_two(highest) for highest in (1, 2, 6, 8)] == [(1,), (1, 2), (1, 2, 4, 6), (1, 2, 4, 8)]


def test_ranges_suit_the_environment() -> None:
    assert ScalingRanges.choose(CONFIG).threads == ()  # not an environment of FRobs
    arm = RunConfig(environment="frobs/Irb120Reach-v0")
    assert ScalingRanges.choose(arm).threads[0] == 1
    assert ScalingRanges.choose(arm, num_envs=(1,)).threads == ()


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"num_envs": ()}, "number of sizes in num_envs is 0"),
        ({"num_envs": (0,)}, "num_envs is 0"),
        ({"processes": (1, -1)}, "processes is -1"),
        ({"seconds": 0.0}, "seconds"),
    ],
)
def test_bad_ranges_are_rejected(ranges: Any, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        ScalingRanges(**ranges)


@pytest.mark.slow
def test_a_job_of_a_runner_measures_as_a_process_of_this_machine_does(tmp_path: Path) -> None:
    here = measure_processes(CONFIG, "processes", 1, 0.2)
    there = measure_cluster(CONFIG, 1, 0.2, load_runner("local"), tmp_path, 2**28)
    assert (there.sweep, there.processes, there.nodes, there.hosts) == ("cluster", 1, 1, 1)
    assert there.memory == pytest.approx(here.memory, rel=0.2)
    assert min(here.steps_per_second, there.steps_per_second) > 100.0


@pytest.mark.slow
def test_the_error_of_a_process_is_the_error_of_the_measurement(tmp_path: Path) -> None:
    config = CONFIG.model_copy(update={"environment_kwargs": {"simulator": "mujoco"}})
    with pytest.raises(ConfigurationError, match="'CartPole-v1' cannot be built with simulator='mujoco'"):
        measure_processes(config, "processes", 2, 0.2)
    with pytest.raises(ConfigurationError, match="cannot measure 1 process on the cluster: environment 'CartPole-v1'"):
        measure_cluster(config, 1, 0.2, load_runner("local"), tmp_path, 2**28)
