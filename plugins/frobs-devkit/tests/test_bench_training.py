"""The benchmark of training runs assigns each moment to one part; no test asks how fast anything is."""

from __future__ import annotations

import json
import tempfile
from time import sleep
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from frobs_cli.program import program
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.bench_training import TrainingBenchResult, bench_training
from frobs_devkit.timing import Stopwatch
from frobs_train import RunConfig, resolve_config

ID = "frobs/Irb120Reach-v0"
PARTS = {"simulation", "inference", "updates", "storage", "other"}
SETTINGS = {
    "ppo": ["algorithm_config.n_steps=8", "algorithm_config.n_epochs=1", "algorithm_config.batch_size=16"],
    "sac": [
        "algorithm_config.learning_starts=20",
        "algorithm_config.batch_size=16",
        "algorithm_config.buffer_size=500",
    ],
}
SMALL = ["num_envs=4", "steps=2_000", "algorithm_config.policy_kwargs.net_arch=[8]"]


def measure(algorithm: str, *, suggest: bool = False) -> TrainingBenchResult:
    config = resolve_config(ID, flags={"algorithm": algorithm}, settings=[*SMALL, *SETTINGS[algorithm]])
    return bench_training(config, steps=100, suggest=suggest)


def frobs(*args: str) -> Result:
    options = [option for setting in (*SMALL, *SETTINGS["ppo"]) for option in ("--set", setting)]
    return CliRunner().invoke(program(), ["bench", ID, *args, *(options if "--training" in args else ())])


class SlowMethods:
    """A fake whose methods take a known time."""

    def outer(self) -> None:
        sleep(0.01)
        self.inner()

    def inner(self) -> None:
        sleep(0.05)


def test_steps_that_are_updates_are_measured() -> None:
    chosen = ["num_envs=2", "steps=200", "algorithm_config.demonstrations=random", "algorithm_config.net_arch=[8]"]
    chosen += ["algorithm_config.demonstration_episodes=2"]
    result = bench_training(resolve_config(ID, flags={"algorithm": "bc"}, settings=chosen), steps=20)
    assert result.steps >= 20
    assert result.steps_per_second > 0.0


@pytest.mark.needs("pybullet")
def test_several_simulators_are_chosen_as_for_training(monkeypatch: pytest.MonkeyPatch) -> None:
    measured: list[Any] = []

    def measure(config: RunConfig, steps: int | None) -> None:
        measured.append(config.num_envs)
        raise ConfigurationError("the settings are known.")

    monkeypatch.setattr("frobs_devkit.bench_training.bench_training", measure)
    CliRunner().invoke(program(), ["bench", ID, "--training", "--num-envs", "mujoco=2,pybullet=1"])
    assert measured == [{"mujoco": 2, "pybullet": 1}]


@pytest.mark.parametrize("algorithm", SETTINGS)
def test_parts_are_positive_and_add_up_to_the_total(algorithm: str) -> None:
    result = measure(algorithm)
    assert set(result.parts) == PARTS
    assert all(seconds > 0.0 for seconds in result.parts.values())
    assert sum(result.parts.values()) == pytest.approx(1_000 / result.steps_per_second)
    assert sum(result.shares.values()) == pytest.approx(1.0)
    assert result.checkpoint_seconds > 0.0
    training = 2_000 / result.steps_per_second
    assert result.total_seconds == pytest.approx(training + result.checkpoints * result.checkpoint_seconds)
    assert result.steps >= 100


def test_nested_call_is_subtracted_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr("frobs_devkit.timing.perf_counter", lambda: clock[0])
    monkeypatch.setattr(f"{__name__}.sleep", lambda seconds: clock.__setitem__(0, clock[0] + seconds))
    stopwatch, methods = Stopwatch(), SlowMethods()
    stopwatch.watch("outer", methods, "outer")
    stopwatch.watch("inner", methods, "inner")
    methods.outer()
    assert stopwatch.seconds("outer") == pytest.approx(0.01)
    assert stopwatch.seconds("inner") == pytest.approx(0.05)


def test_sleep_in_the_buffer_counts_as_storage_only(monkeypatch: pytest.MonkeyPatch) -> None:
    from stable_baselines3.common.buffers import RolloutBuffer

    add = RolloutBuffer.add

    def slow_add(self: RolloutBuffer, *args: Any, **kwargs: Any) -> None:
        sleep(0.02)
        add(self, *args, **kwargs)

    monkeypatch.setattr(RolloutBuffer, "add", slow_add)
    result = measure("ppo")
    assert result.parts["storage"] >= 1_000 / 4 * 0.02  # one call for the four environments
    assert result.parts["storage"] == max(result.parts.values())
    assert result.parts["other"] < 1_000 / 4 * 0.02


def test_algorithm_without_parts_reports_simulation_and_algorithm(monkeypatch: pytest.MonkeyPatch) -> None:
    from frobs_algos_sb3.algorithm import SB3Algorithm

    monkeypatch.setattr(SB3Algorithm, "timed_parts", lambda self: {})
    result = measure("ppo", suggest=True)
    assert set(result.parts) == {"simulation", "algorithm"}
    assert sum(result.shares.values()) == pytest.approx(1.0)
    assert set(result.suggestions) <= {"num_envs", "threads.simulator"}


def test_no_folder_remains(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    measure("sac")
    assert list(tmp_path.iterdir()) == []


def test_suggestions_report_a_gain_or_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    from frobs_devkit import training_advice
    from frobs_devkit.training_window import MeasuredTraining

    rates = {4: 100.0, 8: 190.0, 16: 200.0}
    monkeypatch.setattr(training_advice, "_measure_sizes", lambda config: rates)
    monkeypatch.setattr(training_advice, "time_steps", lambda *args: 1.0)
    monkeypatch.setattr(training_advice, "_time_updates", lambda config, threads: 1.0)
    config = resolve_config(ID, flags={"algorithm": "sac"}, settings=[*SMALL, "algorithm_config.gradient_steps=16"])

    def advise(simulation: float, updates: float) -> dict[str, str]:
        parts = {"simulation": simulation, "updates": updates}
        calls = {"updates": [updates / 10] * 10}
        return training_advice.advise(config, MeasuredTraining(1_000, 10.0, parts, calls, 0.1, uses_torch=False))

    assert set(advise(9.0, 0.5)) == {"num_envs"}
    assert "num_envs=8 instead of 4" in advise(9.0, 0.5)["num_envs"]
    assert "This setting also affects the learned policy" in advise(9.0, 0.5)["num_envs"]
    found = advise(0.5, 8.8)
    assert set(found) == {"algorithm_config.gradient_steps"}
    text = "Updates take 88 % of the time. With gradient_steps=8 instead of 16, the training run would take 11 s instead of 20 s"
    assert found["algorithm_config.gradient_steps"].startswith(text)
    # 10 rounds of 16 gradient steps in 250 vector steps: 8.8 s / 160 and 0.5 s / 250
    text = (
        "A gradient step takes 55 ms. There are 0.64 gradient steps per vector step, and simulating one vector step takes "
        "as long as 0.036 gradient steps."
    )
    assert text in found["algorithm_config.gradient_steps"]


def test_number_of_torch_threads_is_restored() -> None:
    import torch

    from frobs_devkit import training_advice

    config = resolve_config(ID, flags={"algorithm": "sac"}, settings=[*SMALL, *SETTINGS["sac"]])
    before = torch.get_num_threads()
    assert training_advice._time_updates(config.model_copy(update={"steps": 100}), before + 1) > 0.0
    assert torch.get_num_threads() == before


def test_command_prints_a_table_and_json(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frobs_devkit.bench_training.advise", lambda *args: {"num_envs": "With num_envs=8, …"})
    result = frobs("--training", "--steps", "100")
    assert result.exit_code == 0, result.output
    assert all(f"\n    {part} " in result.stdout for part in PARTS)
    assert "With num_envs=8" in result.stdout
    found = json.loads(frobs("--training", "--steps", "100", "--num-envs", "2", "--json").stdout)
    assert set(found["parts"]) == PARTS
    assert found["total_steps"] == 2_000
    assert found["num_envs"] == 4  # --set takes precedence, as in 'frobs train'


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("--algorithm", "sac"), "--algorithm: this option requires --training."),
        (("--set", "num_envs=2"), "--set: this option requires --training or --scaling."),
        (("--training", "--args", "a:=1"), "--args: use --set environment_kwargs."),
        (("--training", "--package-path", "."), "--package-path: use --set environment_kwargs."),
    ],
)
def test_options_of_the_other_kind_are_rejected(args: tuple[str, ...], message: str) -> None:
    result = frobs(*args)
    assert result.exit_code == 2
    assert message in result.stderr


def test_steps_out_of_range_are_rejected() -> None:
    with pytest.raises(ConfigurationError, match="steps is 0; it must be a whole number of at least 1"):
        bench_training(resolve_config(ID), steps=0)
