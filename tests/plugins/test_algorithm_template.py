"""``templates/algorithm.py``, installed as a distribution of its own."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.plugins import Plugins
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import CheckpointError, ConfigurationError, RunError
from frobs_devkit.testing import check_algorithm, run_checks
from frobs_train import Run, RunConfig, evaluate, resolve_config, train
from frobs_train.configuration.config import algorithm_record
from frobs_train.logs.progress import read_progress

SOURCE = Path(__file__).parents[2] / "templates" / "algorithm.py"
REACH = ("population=64", "elite=0.125", "episodes=2", "initial_deviation=0.5", "extra_deviation=0.1")
TINY = {"population": 4, "elite": 0.5}


@pytest.fixture
def installed(site: Any) -> Iterator[AlgorithmRecord]:
    site.add("my-algorithms", {"my_algorithms.py": SOURCE.read_text("utf-8")})
    ours = [found for found in distributions() if found.name.startswith("frobs-")]
    with ExitStack() as stack:
        theirs = distributions(path=[str(site.path)])
        stack.enter_context(plugins.isolated(Plugins([*ours, *theirs], strict=True, disabled=())))
        yield algorithm_record("cross_entropy")


def cartpole(**changes: Any) -> RunConfig:
    flags = {"algorithm": "cross_entropy", "num_envs": 16, "steps": 40_000, "seed": 1, **changes}
    return resolve_config("CartPole-v1", flags=flags)


@pytest.mark.parametrize(
    ("id", "hidden"), [pytest.param("Pendulum-v1", 0, marks=pytest.mark.slow), ("Pendulum-v1", 5), ("CartPole-v1", 0)]
)
def test_it_passes_the_kit(id: str, hidden: int, installed: AlgorithmRecord) -> None:
    report = run_checks(check_algorithm(installed, {**TINY, "hidden": hidden}, id=id))
    assert [(result.name, result.message) for result in report.failed] == []
    assert [(result.name, result.message) for result in report.inconclusive] == []


@pytest.mark.slow
def test_it_learns_to_balance_a_pole_with_a_log_and_checkpoints(installed: AlgorithmRecord, tmp_path: Path) -> None:
    run = train(cartpole(), tmp_path / "run")
    columns = read_progress(run.path / "progress.csv")
    assert {"cross_entropy/reward_of_elite", "cross_entropy/deviation", "episode/reward"} <= set(columns)
    assert len(run.checkpoints) == 3
    assert evaluate(run, episodes=20).mean_reward > 400


@pytest.mark.slow
def test_it_learns_to_come_closer_with_the_tool(installed: AlgorithmRecord, tmp_path: Path) -> None:
    config = resolve_config(
        "frobs/Irb120Reach-v0",
        flags={"algorithm": "cross_entropy", "controller": "tcp_delta_position", "num_envs": 128, "steps": 38_000},
        settings=["seed=0", *(f"algorithm_config.{setting}" for setting in REACH)],
    )
    run = train(config, tmp_path / "run")
    rewards = read_progress(run.path / "progress.csv")["cross_entropy/reward_of_population"]
    assert rewards[-1] > rewards[0] + 5


@pytest.mark.parametrize("num_envs", [1, 3, 16])
def test_each_draw_plays_its_episodes_with_any_number_of_environments(
    num_envs: int, installed: AlgorithmRecord, tmp_path: Path
) -> None:
    config = cartpole(num_envs=num_envs, steps=1, log_every=1).model_copy(
        update={"algorithm_config": {"population": 5, "episodes": 2}}
    )
    run = train(config, tmp_path / "run")
    columns = read_progress(run.path / "progress.csv")
    assert columns["episode/count"][0] >= 10
    if num_envs == 1:  # else some environments begin an episode that nobody waits for
        assert columns["episode/count"] == [10]
        assert columns["cross_entropy/reward_of_population"] == columns["episode/reward"]


def test_training_goes_on_from_a_checkpoint_as_if_it_had_never_stopped(
    installed: AlgorithmRecord, tmp_path: Path
) -> None:
    import gymnasium as gym
    from gymnasium.vector import AutoresetMode

    def make() -> Any:
        env = gym.make_vec("CartPole-v1", 2, "sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP})
        env.reset(seed=3)
        return env

    class Saves:
        generators: Any = None

        def is_due(self, steps: int) -> bool:
            return True

        def on_progress(self, steps: int, metrics: Any) -> bool:
            return True

        def offer_checkpoint(self, steps: int, save: Any) -> None:
            if steps > 100 and not (tmp_path / "saved").exists():
                (tmp_path / "saved").mkdir()
                save(tmp_path / "saved", None)
                self.generators = [one.unwrapped.np_random.bit_generator.state for one in env.envs]

    cls, env, monitor = installed.load(), make(), Saves()
    first = cls(env, cls.resolve_config(TINY), 5)
    first.train(600, monitor)
    other = make()
    for one, state in zip(other.envs, monitor.generators, strict=True):
        one.unwrapped.np_random.bit_generator.state = state
    second = cls.load(tmp_path / "saved", other)
    second.train(600, Saves())
    for folder, algorithm in (("a", first), ("b", second)):
        (tmp_path / folder).mkdir()
        algorithm.save(tmp_path / folder)
    for name in ("algorithm.json", "distribution.npz"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_what_it_cannot_do_is_told(installed: AlgorithmRecord, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="population is 1"):
        installed.load().resolve_config({"population": 1})
    with pytest.raises(ConfigurationError, match="flat observations"):
        train(RunConfig(environment="frobs/Irb120ReachGoal-v0", algorithm="cross_entropy"), tmp_path / "goal")
    run = train(cartpole(steps=1), tmp_path / "run")
    folder = run.checkpoints[-1].path / "algorithm"
    with pytest.raises(RunError, match="for prediction only"):
        installed.load().load(folder).train(10, None)
    told = json.loads((folder / "algorithm.json").read_text())
    (folder / "algorithm.json").write_text(json.dumps({**told, "format": 7}))
    with pytest.raises(CheckpointError, match="format 7"):
        installed.load().load(folder)


def test_a_policy_acts_alike_alone_and_in_a_batch(installed: AlgorithmRecord, tmp_path: Path) -> None:
    run = train(cartpole(steps=1), tmp_path / "run")
    assert isinstance(run, Run)
    algorithm = installed.load().load(run.checkpoints[-1].path / "algorithm")
    seen = np.random.default_rng(0).normal(size=(7, 4))
    together = algorithm.predict(seen)[0]
    assert [algorithm.predict(row[None])[0][0] for row in seen] == together.tolist()
