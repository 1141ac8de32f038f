from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import stable_baselines3 as sb3
import stock_models
import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import DictReplayBuffer, ReplayBuffer
from stable_baselines3.her import HerReplayBuffer
from stock_models import FlatDictionary, as_of_2021

from frobs_algos_sb3.model_files import load_model, read_replay_buffer, save_model, sidecar_path, write_replay_buffer
from frobs_core.util.errors import CheckpointError, ConfigurationError, UntrustedFileError


def observations(model: BaseAlgorithm, count: int = 20) -> list[Any]:
    space = model.observation_space
    assert space is not None
    space.seed(0)
    return [space.sample() for _ in range(count)]


def act(model: BaseAlgorithm, given: list[Any], deterministic: bool) -> list[np.ndarray[Any, Any]]:
    th.manual_seed(1)
    np.random.seed(1)  # noqa: NPY002  # what stable-baselines3 draws from
    actions, state = [], None
    for number, observation in enumerate(given):
        start = np.array([number % 7 == 0])
        action, state = model.predict(observation, state, start, deterministic)
        actions.append(action)
    return actions


@pytest.mark.parametrize("name", stock_models.MODELS)
def test_a_stock_model_predicts_the_same_without_trust(name: str, tmp_path: Path) -> None:
    path = stock_models.write(name, tmp_path)
    th.manual_seed(2)  # the noise of state-dependent exploration is drawn when a model is loaded
    ours = load_model(path, spaces=stock_models.spaces_of(path), device="cpu")
    th.manual_seed(2)
    stock = type(ours).load(path, device="cpu")
    assert type(ours).__name__.lower() == name.partition("-")[0].replace("_", "")
    assert ours.observation_space == stock.observation_space
    given = observations(stock)
    for deterministic in (True, False):
        for mine, theirs in zip(act(ours, given, deterministic), act(stock, given, deterministic), strict=True):
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("name", ["ppo", "ppo-layers", "a2c", "dqn-layers", "sac-sde", "td3-layers", "ddpg-layers"])
def test_training_goes_on_as_with_the_library_s_own_loader(name: str, tmp_path: Path) -> None:
    path = stock_models.write(name, tmp_path)
    env_id = "CartPole-v1" if name == "dqn-layers" else "Pendulum-v1"
    given = {"train_freq": (1, "step"), "learning_starts": 8, "batch_size": 8, "action_noise": None}
    if name.startswith(("ppo", "a2c")):
        given = {"learning_rate": 1e-3, **({"clip_range": 0.2} if name.startswith("ppo") else {})}
    weights = []
    for trust in (False, True):
        model = load_model(path, gym.make(env_id), trust=trust, device="cpu", seed=3, **given)
        model.learn(80)
        weights.append(model.policy.state_dict())
    for key, value in weights[0].items():
        assert th.equal(value, weights[1][key]), key


def test_the_suffix_may_be_left_out(tmp_path: Path) -> None:
    path = stock_models.write("a2c", tmp_path)
    assert isinstance(load_model(path.with_suffix(""), gym.make("Pendulum-v1")), sb3.A2C)


def test_without_an_environment_a_model_needs_trust(tmp_path: Path) -> None:
    path = stock_models.write("a2c", tmp_path)
    with pytest.raises(
        UntrustedFileError, match=r"without an environment \(env=…\), the model's spaces.*--trust or trust=True"
    ):
        load_model(path)
    assert load_model(path, trust=True).observation_space.shape == (3,)


def test_what_only_training_needs_is_missed_only_by_training(tmp_path: Path) -> None:
    path = tmp_path / "scheduled.zip"
    sb3.PPO("MlpPolicy", "Pendulum-v1", n_steps=64, learning_rate=lambda left: 1e-3 * left).save(path)
    model = load_model(path, spaces=stock_models.spaces_of(path))
    with pytest.raises(UntrustedFileError, match=r"the learning rate is a function"):
        model.lr_schedule(1.0)
    with pytest.raises(
        UntrustedFileError,
        match=r"'learning_rate' is stored as a pickle.* or pass learning_rate=….*--trust or trust=True",
    ):
        load_model(path, gym.make("Pendulum-v1"), clip_range=0.2)
    assert load_model(path, gym.make("Pendulum-v1"), clip_range=0.2, learning_rate=1e-4).lr_schedule(0.5) == 1e-4
    assert (
        load_model(path, gym.make("Pendulum-v1"), defaults={"learning_rate": 1e-5, "clip_range": 0.1}).lr_schedule(0.5)
        == 1e-5
    )
    assert load_model(path, gym.make("Pendulum-v1"), trust=True).lr_schedule(0.5) == 5e-4


class OwnActivation(th.nn.ReLU):
    """Not the library's."""


class OwnPolicy(sb3.ppo.MlpPolicy):
    """Not the library's."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)


@pytest.mark.parametrize(
    ("policy", "kwargs", "message"),
    [
        (OwnPolicy, {}, r"'policy_class' is stored as a pickle.*OwnPolicy is not a policy class of stable-baselines3"),
        ("MlpPolicy", {"activation_fn": OwnActivation}, r"'policy_kwargs' is stored as a pickle.*activation_fn .*OwnActivation.*is not one of ReLU"),
    ],
)  # fmt: skip
def test_a_custom_part_needs_trust(policy: Any, kwargs: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / "custom.zip"
    sb3.PPO(policy, "Pendulum-v1", n_steps=64, policy_kwargs=kwargs).save(path)
    with pytest.raises(UntrustedFileError, match=message):
        load_model(path, spaces=stock_models.spaces_of(path))
    assert isinstance(load_model(path, trust=True), sb3.PPO)


@pytest.mark.parametrize("trust", [False, True])
def test_a_model_of_2021_with_shared_layers_and_spaces_of_gym_predicts_and_trains_on(
    trust: bool, tmp_path: Path
) -> None:
    kwargs = {"net_arch": {"pi": [6, 5], "vf": [6, 4]}}
    model = sb3.PPO("MlpPolicy", "Pendulum-v1", n_steps=64, device="cpu", policy_kwargs=kwargs)
    first = model.policy.mlp_extractor
    first.value_net[0].load_state_dict(first.policy_net[0].state_dict())
    path = tmp_path / "old.zip"
    model.save(path)
    given = observations(model)
    expected = act(model, given, deterministic=True)
    values = model.policy.predict_values(th.as_tensor(np.array(given)))
    as_of_2021(path)

    opened = load_model(path, gym.make("Pendulum-v1"), trust=trust, device="cpu", clip_range=0.2)
    with th.no_grad():
        assert th.allclose(opened.policy.predict_values(th.as_tensor(np.array(given))), values, atol=1e-6)
    np.testing.assert_allclose(act(opened, given, deterministic=True), expected, atol=1e-6)
    assert len(opened.policy.optimizer.state_dict()["state"]) == len(list(opened.policy.parameters()))
    opened.learn(64)


def test_a_schedule_that_ended_below_zero_does_not_prevent_predictions(tmp_path: Path) -> None:
    path = tmp_path / "old.zip"
    model = sb3.PPO("MlpPolicy", "Pendulum-v1", n_steps=64, learning_rate=lambda _: 1e-3)
    model.policy.optimizer.param_groups[0]["lr"] = -1e-9
    model.save(path)
    load_model(path, spaces=stock_models.spaces_of(path)).predict(np.zeros(3, np.float32))


def test_another_algorithm_s_file_is_refused(tmp_path: Path) -> None:
    path = stock_models.write("sac", tmp_path)
    with pytest.raises(CheckpointError, match="a model of 'sac', not of 'ppo'"):
        load_model(path, algorithm="ppo")


@pytest.mark.parametrize(
    ("space", "message"),
    [
        (gym.spaces.Discrete(2), r"action_space Box\(shape=\[1\], low=\[-2.\], high=\[2.\]\), but .*Discrete\(2\)"),
        (gym.spaces.Box(-2.0, 2.0, (2,)), "trained with action_space"),
        (gym.spaces.Box(-1.0, 2.0, (1,)), "trained with action_space"),
    ],
)
@pytest.mark.parametrize("trust", [False, True])
def test_other_spaces_are_refused(space: gym.Space[Any], message: str, trust: bool, tmp_path: Path) -> None:
    path = stock_models.write("ppo", tmp_path)
    observation_space = gym.make("Pendulum-v1").observation_space
    with pytest.raises(ConfigurationError, match=message):
        load_model(path, spaces=(observation_space, space), trust=trust)
    with pytest.raises(ConfigurationError, match="trained with observation_space"):
        load_model(path, gym.make("MountainCarContinuous-v0"), trust=trust)


def test_bounds_come_exactly_from_the_environment_or_the_file_beside(tmp_path: Path) -> None:
    path = stock_models.write("a2c-pictures", tmp_path)
    exact = stock_models.Pictures.action_space
    assert load_model(path, stock_models.Pictures()).action_space == exact
    save_model(load_model(path, stock_models.Pictures()), tmp_path / "ours.zip")
    assert load_model(tmp_path / "ours.zip").action_space == exact


def test_our_own_model_trains_on_without_trust(tmp_path: Path) -> None:
    model = sb3.TD3(
        "MlpPolicy", "Pendulum-v1", train_freq=(2, "step"), action_noise=stock_models.NOISE, **stock_models.SMALL
    )
    save_model(model, tmp_path / "ours.zip")
    opened = load_model(tmp_path / "ours.zip", gym.make("Pendulum-v1"))
    assert opened.train_freq == model.train_freq
    assert repr(opened.action_noise) == repr(model.action_noise)
    assert isinstance(sb3.TD3.load(tmp_path / "ours.zip"), sb3.TD3)


def test_the_file_beside_counts_only_for_its_own_model(tmp_path: Path) -> None:
    model = sb3.TD3("MlpPolicy", "Pendulum-v1", train_freq=(2, "step"), **stock_models.SMALL)
    path = tmp_path / "ours.zip"
    save_model(model, path)
    model.save(path)  # with stable-baselines3, which writes no file beside it; the archive's dates differ
    sidecar_path(path).write_text(sidecar_path(path).read_text().replace('"sha256": "', '"sha256": "0'))
    with pytest.raises(UntrustedFileError, match="'train_freq'"):
        load_model(path, gym.make("Pendulum-v1"))


def test_a_damaged_file_beside_is_named(tmp_path: Path) -> None:
    path = tmp_path / "ours.zip"
    save_model(sb3.A2C("MlpPolicy", "Pendulum-v1"), path)
    sidecar_path(path).write_text(sidecar_path(path).read_text().replace('"Box"', '"Bax"'))
    with pytest.raises(CheckpointError, match=r"ours\.json is damaged.*'Bax'"):
        load_model(path)


def test_a_model_with_hindsight_replay_predicts_without_an_environment(tmp_path: Path, make: Any) -> None:
    env = gym.make("frobs_core:frobs/Irb120ReachGoal-v0")
    model = sb3.SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 3},
        **stock_models.SMALL,
    )
    model.save(tmp_path / "her.zip")
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(
        load_model(tmp_path / "her.zip", spaces=stock_models.spaces_of(tmp_path / "her.zip")).predict(
            observation, deterministic=True
        )[0],
        model.predict(observation, deterministic=True)[0],
    )
    trained_on = load_model(tmp_path / "her.zip", env, train_freq=(1, "step"))
    assert isinstance(trained_on.replay_buffer, HerReplayBuffer)
    assert trained_on.replay_buffer.n_sampled_goal == 3
    env.close()


def filled(steps: int, capacity: int = 10, kind: type[ReplayBuffer] = ReplayBuffer, seed: int = 0) -> ReplayBuffer:
    rng = np.random.default_rng(seed)
    space = FlatDictionary.observation_space if kind is DictReplayBuffer else gym.spaces.Box(-1, 1, (3,))
    buffer = kind(capacity, space, gym.spaces.Box(-1, 1, (2,)), n_envs=1)
    for _ in range(steps):
        observation: Any = rng.random((1, 3)) if kind is ReplayBuffer else {key: rng.random((1, 2)) for key in space}  # type: ignore[union-attr]
        buffer.add(
            observation,
            observation,
            rng.random((1, 2)),
            rng.random(1),
            np.array([False]),
            [{"TimeLimit.truncated": True}],
        )
    return buffer


@pytest.mark.parametrize("kind", [ReplayBuffer, DictReplayBuffer])
@pytest.mark.parametrize("steps", [0, 4, 10, 13])
def test_a_replay_buffer_comes_back_as_it_was(kind: type[ReplayBuffer], steps: int, tmp_path: Path) -> None:
    buffer, other = filled(steps, kind=kind), filled(2, kind=kind, seed=1)
    write_replay_buffer(buffer, tmp_path / "buffer.npz")
    read_replay_buffer(other, tmp_path / "buffer.npz")
    assert (other.pos, other.full) == (buffer.pos, buffer.full)
    for name in ("observations", "next_observations", "actions", "rewards", "dones", "timeouts"):
        mine, theirs = getattr(buffer, name), getattr(other, name)
        for key in mine if isinstance(mine, dict) else [...]:
            np.testing.assert_array_equal(theirs[key][: buffer.size()], mine[key][: buffer.size()])


def test_a_smaller_replay_buffer_takes_the_newest_steps(tmp_path: Path) -> None:
    buffer, small, large = filled(13), filled(0, capacity=4), filled(0, capacity=20)
    write_replay_buffer(buffer, tmp_path / "buffer.npz")
    newest = buffer.rewards[[9, 0, 1, 2]]
    read_replay_buffer(small, tmp_path / "buffer.npz")
    np.testing.assert_array_equal(small.rewards, newest)
    assert (small.pos, small.full) == (0, True)
    read_replay_buffer(large, tmp_path / "buffer.npz")
    np.testing.assert_array_equal(large.rewards[6:10], newest)
    assert (large.pos, large.full) == (10, False)


def test_a_replay_buffer_of_another_kind_is_refused(tmp_path: Path) -> None:
    write_replay_buffer(filled(4), tmp_path / "buffer.npz")
    with pytest.raises(CheckpointError, match="does not match the model's replay buffer"):
        read_replay_buffer(filled(0, kind=DictReplayBuffer), tmp_path / "buffer.npz")
