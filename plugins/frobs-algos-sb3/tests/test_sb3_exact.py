"""A training that was saved, loaded and continued equals one that was not, to the last bit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch as th

from frobs_algos import storage
from frobs_core import plugins

REACH, GOAL = "frobs/Irb120Reach-v0", "frobs/Irb120ReachGoal-v0"
DISCRETE = {"controller": "discrete"}

ROLLOUT = {"n_steps": 8, "policy_kwargs": {"net_arch": [8]}}
EPOCHS = {**ROLLOUT, "batch_size": 16, "n_epochs": 2}
REPLAY = {
    "learning_starts": 30,
    "buffer_size": 120,  # it is full, and overwritten, before the half
    "batch_size": 16,
    "train_freq": 6,
    "gradient_steps": 2,
    "policy_kwargs": {"net_arch": [8]},
}
HINDSIGHT = {**REPLAY, "buffer_size": 200}  # the same, before the end: two episodes of each environment fit in
NORMAL = {"normalize_observation": True, "normalize_reward": True, "learning_rate": "lin_1e-3"}
SDE = {"use_sde": True, "sde_sample_freq": 5}
WANDERING = {"action_noise": {"type": "ornstein_uhlenbeck", "sigma": 0.2}}

CASES = {
    "ppo": ("ppo", REACH, EPOCHS),
    "ppo-sde-normalized": ("ppo", REACH, {**EPOCHS, **NORMAL, **SDE}),
    "ppo-goal-normalized": ("ppo", GOAL, {**EPOCHS, **NORMAL, "clip_range": "lin_0.2"}),
    "a2c-sde": ("a2c", REACH, {**ROLLOUT, "use_sde": True}),
    "sac-normalized": ("sac", REACH, {**REPLAY, **NORMAL, **WANDERING}),
    "sac-sde-normalized": ("sac", REACH, {**REPLAY, **NORMAL, **SDE}),
    "sac-sde-warmup": ("sac", REACH, {**REPLAY, "use_sde": True, "use_sde_at_warmup": True, "ent_coef": 0.1}),
    "td3": ("td3", REACH, {**REPLAY, "action_noise": {"sigma": 0.2}, "n_steps": 3}),
    "ddpg-normalized": ("ddpg", REACH, {**REPLAY, **NORMAL, **WANDERING}),
    "ddpg-memory": (
        "ddpg",
        REACH,
        {**REPLAY, "optimize_memory_usage": True, "replay_buffer": {"handle_timeout_termination": False}},
    ),
    "dqn": ("dqn", REACH, {**REPLAY, "target_update_interval": 40, "exploration_fraction": 0.9}),
    "sac-hindsight": ("sac", GOAL, HINDSIGHT),
    "td3-hindsight-normalized": ("td3", GOAL, {**HINDSIGHT, **NORMAL}),
    "tqc-sde": ("tqc", REACH, {**REPLAY, **SDE}),
    "crossq": ("crossq", REACH, REPLAY),
    "recurrent_ppo-normalized": ("recurrent_ppo", REACH, {**EPOCHS, **NORMAL}),
    "recurrent_ppo-sde": ("recurrent_ppo", REACH, {**EPOCHS, **SDE}),
}
HALF, WHOLE = 144, 240  # episodes end at 100 and 200; a rollout begins at both numbers


@pytest.mark.parametrize(
    ("name", "environment", "config"),
    [pytest.param(*case, id=name, marks=[pytest.mark.slow] if "-" in name else []) for name, case in CASES.items()],
)
def test_continuing_changes_no_bit(
    name: str, environment: str, config: dict[str, Any], make: Any, monitor: Any, tmp_path: Path
) -> None:
    cls = plugins.get_record("algorithm", name).load()
    kwargs = DISCRETE if name.endswith("dqn") else {}
    env = make(environment, 2, **kwargs)
    snapshots: dict[int, Any] = {}
    monitor.save_at = {HALF: tmp_path / "half"}
    monitor.on_offer = lambda steps: snapshots.setdefault(steps, env.unwrapped.snapshot())
    straight = cls(env, config, 3)
    straight.train(WHOLE, monitor)
    rows = dict(monitor.rows)

    other = make(environment, 2, seed=77, **kwargs)
    other.unwrapped.restore(snapshots[HALF])
    th.manual_seed(1)
    resumed = cls.load(tmp_path / "half", other)
    monitor.rows, monitor.save_at = [], {}
    resumed.train(WHOLE, monitor)
    assert monitor.rows
    assert all(rows[steps] == metrics for steps, metrics in monitor.rows)
    assert_same(straight, resumed, tmp_path)
    np.testing.assert_equal(env.unwrapped.snapshot(), other.unwrapped.snapshot())


@pytest.mark.parametrize("case", ["sac-sde-normalized", "recurrent_ppo-sde", "sac-hindsight"])
def test_what_was_loaded_and_saved_at_once_continues_too(case: str, make: Any, monitor: Any, tmp_path: Path) -> None:
    name, environment, config = CASES[case]
    cls = plugins.get_record("algorithm", name).load()
    env = make(environment, 2)
    monitor.save_at = {HALF: tmp_path / "half"}
    cls(env, config, 3).train(HALF + 48, monitor)
    (tmp_path / "again").mkdir()
    cls.load(tmp_path / "half", env).save(tmp_path / "again", tmp_path / "half")
    assert contents(tmp_path / "again") == contents(tmp_path / "half")


@pytest.mark.parametrize("case", ["sac-sde-normalized", "ppo-sde-normalized", "td3"])
def test_a_training_that_was_stopped_goes_on_with_no_bit_changed(
    case: str, make: Any, monitor: Any, stopping_monitor: Any, tmp_path: Path
) -> None:
    name, environment, config = CASES[case]
    cls = plugins.get_record("algorithm", name).load()
    straight = cls(make(environment, 2), config, 3)
    straight.train(WHOLE, monitor)
    stopped = cls(make(environment, 2), config, 3)
    stopped.train(WHOLE, stopping_monitor)
    assert stopped.model.num_timesteps < WHOLE
    th.manual_seed(1)
    stopped.train(WHOLE, monitor)
    assert_same(straight, stopped, tmp_path)


@pytest.mark.parametrize("case", ["sac-sde-warmup", "ppo-sde-normalized", "td3"])
def test_what_was_saved_after_a_training_or_before_it_continues_too(
    case: str, make: Any, monitor: Any, tmp_path: Path
) -> None:
    name, environment, config = CASES[case]
    config = {**config, "learning_rate": 1e-3}  # a schedule would end with the first training
    cls = plugins.get_record("algorithm", name).load()
    straight = cls(make(environment, 2), config, 3)
    straight.train(HALF, monitor)
    straight.train(WHOLE, monitor)
    env = make(environment, 2)
    current = cls(env, config, 3)
    for index, steps in enumerate((0, HALF)):
        current.train(steps, monitor)
        (tmp_path / str(index)).mkdir()
        current.save(tmp_path / str(index))
        th.manual_seed(1)
        current = cls.load(tmp_path / str(index), env)
    current.train(WHOLE, monitor)
    assert_same(straight, current, tmp_path)


def assert_same(first: Any, second: Any, folder: Path) -> None:
    """Save both, and compare all that was written."""
    for name, algorithm in (("first", first), ("second", second)):
        (folder / name).mkdir()
        algorithm.save(folder / name)
    expected, found = contents(folder / "first"), contents(folder / "second")
    assert sorted(expected) == sorted(found)
    different = [name for name in expected if expected[name] != found[name]]
    assert not different


def contents(folder: Path) -> dict[str, Any]:
    """Return all that the files of an algorithm hold, as bytes and plain values."""
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*.*")):
        name = path.relative_to(folder).as_posix()
        if path.suffix == ".json":
            found[name] = json.loads(path.read_text("utf-8"))
        else:
            value = storage.read_arrays(path) if path.suffix == ".npz" else storage.read_tensors(path)
            found |= {f"{name}/{key}": leaf for key, leaf in leaves(value)}
    return found


def leaves(value: Any, prefix: str = "") -> list[tuple[str, Any]]:
    if isinstance(value, Mapping):
        return [leaf for key, item in value.items() for leaf in leaves(item, f"{prefix}/{key}")]
    if isinstance(value, list | tuple):
        return [leaf for index, item in enumerate(value) for leaf in leaves(item, f"{prefix}/{index}")]
    if isinstance(value, th.Tensor):
        value = value.numpy()
    if isinstance(value, np.ndarray):
        return [(prefix, (value.dtype.str, value.shape, value.tobytes()))]
    return [(prefix, value)]
