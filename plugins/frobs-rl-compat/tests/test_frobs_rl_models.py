from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import stable_baselines3 as sb3
import stock_models
import torch as th

from frobs_core.util.errors import CheckpointError, ConfigurationError, RunError, UntrustedFileError
from frobs_core.util.yaml import dump_yaml, load_yaml, merge
from frobs_rl_compat.training import A2C, DDPG, DQN, PPO, SAC, TD3, BasicModel, LogFolderExistsError, NotTrainedError
from frobs_rl_compat.training.config_files import DEFAULTS

CLASSES = [PPO, A2C, DDPG, DQN, SAC, TD3]
Make = Callable[..., BasicModel]

th.set_num_threads(1)


@pytest.fixture
def make(tmp_path: Path) -> Any:
    """Makes a model from the default file with some keys changed; its own block's are given as ``block``."""
    made: list[BasicModel] = []

    def make(
        cls: Any, block: dict[str, Any] | None = None, *, env: Any = None, kwargs: Any = None, **params: Any
    ) -> Any:
        default = load_yaml(DEFAULTS / f"{cls.algorithm}_config.yaml")
        small = {"training_steps": 40, "save_freq": 20, "use_custom_policy": True, "policy_params": {"net_arch": [8]}}
        sizes = {"n_steps": 8} if cls in (PPO, A2C) else {"buffer_size": 100, "learning_starts": 5, "batch_size": 8}
        if cls is PPO:
            sizes["batch_size"] = 8
        changed = {"model_params": {**small, **params, f"{cls.algorithm}_params": {**sizes, **(block or {})}}}
        path = tmp_path / "config.yaml"
        path.write_text(dump_yaml(merge(default, changed)))
        env = env or gym.make("CartPole-v1" if cls is DQN else "Pendulum-v1")
        model = cls(
            env, tmp_path / "models", f"{tmp_path}/logs", config_file_pkg=None, config_filename=path, **(kwargs or {})
        )
        made.append(model)
        return model

    yield make
    for model in made:
        model.close_env()


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
def test_a_training_writes_what_frobs_rl_wrote(cls: Any, make: Make, tmp_path: Path) -> None:
    model = make(cls)
    assert model.train() is True
    logs = tmp_path / "logs" / f"{cls.__name__}_1"
    assert (logs / "progress.csv").is_file()
    assert list(logs.glob("events.out.tfevents.*"))
    names = {path.name for path in (tmp_path / "models").glob("*.zip")}
    assert names == {"trained_model.zip", f"{cls.algorithm}_model_20_steps.zip", f"{cls.algorithm}_model_40_steps.zip"}
    stock = getattr(sb3, cls.__name__).load(tmp_path / "models" / "trained_model.zip")
    opened = cls.load_trained(str(tmp_path / "models" / "trained_model"))
    observation, _ = model.env.reset(seed=0)  # type: ignore[union-attr]
    for other in (opened, cls.load_trained(tmp_path / "models" / "trained_model.zip", model.env), stock):
        np.testing.assert_array_equal(
            other.predict(observation, deterministic=True)[0], model.predict(observation, deterministic=True)[0]
        )


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
def test_the_default_file_builds(cls: Any, tmp_path: Path) -> None:
    env = gym.make("CartPole-v1" if cls is DQN else "Pendulum-v1")
    model = cls(env, tmp_path / "models", tmp_path / "logs")
    assert model.settings.params.training_steps == 5000
    assert isinstance(model.model, getattr(sb3, cls.__name__))
    model.close_env()


def test_a_model_is_saved_once_and_with_the_time_where_its_name_is_taken(make: Make, tmp_path: Path) -> None:
    model = make(A2C)
    model.train()
    assert model.save_model() == model.save_model() == tmp_path / "models" / "trained_model.zip"
    assert len(list((tmp_path / "models").glob("trained_model*.zip"))) == 1
    model.train()
    again = model.save_model()
    assert re.fullmatch(r"trained_model_\d\d_\d\d_\d{4}_\d\d_\d\d_\d\d\.zip", again.name)
    assert model.model.num_timesteps == 80


def test_reset_num_timesteps_counts_each_training_from_zero(make: Make) -> None:
    model = make(A2C, reset_num_timesteps=True)
    model.train()
    model.train()
    assert model.model.num_timesteps == 40


def test_no_models_are_saved_meanwhile_where_save_freq_is_zero(make: Make, tmp_path: Path) -> None:
    make(A2C, save_freq=0).train()
    assert [path.name for path in (tmp_path / "models").glob("*.zip")] == ["trained_model.zip"]


@pytest.mark.slow
def test_training_goes_on_with_the_numbers_of_the_file_and_the_replay_buffer(make: Make, tmp_path: Path) -> None:
    first = make(TD3, save_replay_buffer=True)
    first.train()
    assert (tmp_path / "models" / "trained_model_replay_buffer.npz").is_file()
    second = make(
        TD3, {"learning_rate": 0.5, "gamma": 0.5, "train_freq": {"freq": 1, "unit": "episode"}},
        load_model=True, model_name="trained_model", log_folder="next", action_noise={"sigma": 0.7},
    )  # fmt: skip
    assert second.model.num_timesteps == 40
    assert second.model.lr_schedule(1.0) == 0.5
    assert second.model.gamma == 0.5
    assert second.model.train_freq.unit.value == "episode"  # type: ignore[attr-defined]
    assert second.model.action_noise._sigma == [0.7]
    assert second.model.replay_buffer.size() == 40  # type: ignore[attr-defined]
    for key, value in first.model.policy.state_dict().items():
        assert th.equal(value, second.model.policy.state_dict()[key])
    second.train()
    assert second.model.num_timesteps == 240  # whole episodes


def test_a_stock_model_is_trained_on_without_trust_and_its_pickled_buffer_only_with_it(
    make: Make, tmp_path: Path
) -> None:
    (tmp_path / "models").mkdir()
    stock = sb3.SAC("MlpPolicy", "Pendulum-v1", buffer_size=100, learning_starts=5, use_sde=True)
    stock.learn(8)
    stock.save(tmp_path / "models" / "old.zip")
    assert make(SAC, load_model=True, model_name="old").model.num_timesteps == 8
    stock.save_replay_buffer(tmp_path / "models" / "old_replay_buffer.pkl")
    with pytest.raises(UntrustedFileError, match=r"old_replay_buffer\.pkl.*trust=True"):
        make(SAC, load_model=True, model_name="old", log_folder="next")
    trusted = make(SAC, load_model=True, model_name="old", log_folder="next", kwargs={"trust": True})
    assert trusted.model.replay_buffer.size() == 8  # type: ignore[attr-defined]


def test_a_model_that_is_missing_is_named_before_anything_is_written(make: Make, tmp_path: Path) -> None:
    make(A2C).train()
    with pytest.raises(ConfigurationError, match=r"Did you mean 'trained_model'\? Available: a2c_model_20_steps"):
        make(A2C, load_model=True, model_name="trained_modl", log_folder="next")
    assert not (tmp_path / "logs" / "next").exists()


def test_a_log_folder_that_exists_is_a_value_error(make: Make) -> None:
    make(A2C)
    with pytest.raises(LogFolderExistsError, match=r"A2C_1 already exists; change log_folder.*on_existing='increment'"):
        make(A2C)
    with pytest.raises(ValueError, match="exists"):
        make(A2C)
    with pytest.raises(ConfigurationError, match="it must be one of error, increment, overwrite, resume"):
        make(A2C, kwargs={"on_existing": "ask"})


@pytest.mark.parametrize(("folder", "next_one"), [("A2C_1", "A2C_2"), ("A2C_New", "A2C_New_1")])
def test_increment_takes_the_next_free_name(folder: str, next_one: str, make: Make) -> None:
    for expected in (folder, next_one):
        model = make(A2C, log_folder=folder, kwargs={"on_existing": "increment"})
        assert model.log_folder is not None
        assert model.log_folder.name == expected


def test_overwrite_removes_the_logs_and_nothing_else(make: Make, tmp_path: Path) -> None:
    make(A2C, log_interval=1).train()
    note = tmp_path / "logs" / "A2C_1" / "note.txt"
    note.write_text("mine")
    make(A2C, kwargs={"on_existing": "overwrite"})
    assert (tmp_path / "logs" / "A2C_1" / "progress.csv").read_text() == ""
    assert len(list((tmp_path / "logs" / "A2C_1").glob("events*"))) == 1
    assert note.read_text() == "mine"


def test_resume_goes_on_with_the_table(make: Make, tmp_path: Path) -> None:
    make(A2C, log_interval=1).train()
    table = tmp_path / "logs" / "A2C_1" / "progress.csv"
    before = table.read_text()
    with table.open("a") as file:
        file.write("12,3")  # a row that a killed process did not finish
    model = make(A2C, log_interval=1, load_model=True, model_name="trained_model", kwargs={"on_existing": "resume"})
    model.train()
    model.close_env()
    after = table.read_text()
    assert after.startswith(before.splitlines()[0])
    rows = np.genfromtxt(table, delimiter=",", names=True)
    assert rows["timetotal_timesteps"].tolist() == [8.0 * row for row in range(1, 11)]


@pytest.mark.parametrize("cls", [PPO, A2C])
def test_an_imitated_policy_is_begun_with(cls: Any, make: Make, tmp_path: Path) -> None:
    kwargs = {"batch_size": 32} if cls is PPO else {}
    imitated = getattr(sb3, cls.__name__)(
        "MlpPolicy", "Pendulum-v1", policy_kwargs={"net_arch": [6]}, n_steps=32, gamma=0.5, **kwargs
    )
    imitated.save(tmp_path / "imitated.zip")
    model = make(cls, {"gamma": 0.8}, kwargs={"load_il_policy": True, "il_policy_path": tmp_path / "imitated"})
    assert (model.model.gamma, model.model.n_steps) == (0.8, 8)  # type: ignore[attr-defined]
    assert model.model.rollout_buffer.buffer_size == 8  # type: ignore[attr-defined]
    for key, value in imitated.policy.state_dict().items():
        assert th.equal(value, model.model.policy.state_dict()[key])
    model.train()
    with pytest.raises(ConfigurationError, match="needs il_policy_path"):
        make(cls, log_folder="next", kwargs={"load_il_policy": True})


@pytest.mark.parametrize(
    ("params", "check"),
    [
        ({"use_sde": False}, lambda model: repr(model.action_noise) == "NormalActionNoise(mu=[0.], sigma=[0.01])"),
        ({"use_sde": True}, lambda model: model.action_noise is None and model.use_sde),
        ({"use_sde": False, "use_action_noise": False}, lambda model: model.action_noise is None),
        ({"use_sde": True, "sde_params": {"sde_sample_freq": 9, "use_sde_at_warmup": True}},
         lambda model: model.sde_sample_freq == 9 and model.use_sde_at_warmup),
        ({"policy_params": {"activation_fn": "SELU", "optimizer_class": "Adagrad"}},
         lambda model: isinstance(model.actor.latent_pi[1], th.nn.SELU) and isinstance(model.actor.optimizer, th.optim.Adagrad)),
        ({"use_custom_policy": False}, lambda model: model.actor.latent_pi[0].out_features == 256),
    ],
)  # fmt: skip
def test_exploration_and_networks_are_as_the_file_says(params: dict[str, Any], check: Any, make: Make) -> None:
    assert check(make(SAC, **params).model)


def test_an_abstract_features_extractor_is_refused(make: Make) -> None:
    with pytest.raises(ConfigurationError, match="cannot be BaseFeaturesExtractor, which is abstract"):
        make(SAC, policy_params={"features_extractor_class": "BaseFeaturesExtractor"})


def test_a_dictionary_of_observations_gets_the_policy_for_it(make: Make) -> None:
    params = {"policy_params": {"features_extractor_class": "CombinedExtractor"}}
    assert make(A2C, env=stock_models.FlatDictionary(), **params).train()


def test_an_algorithm_that_cannot_act_in_the_environment_says_so(make: Make) -> None:
    with pytest.raises(ConfigurationError, match="requires a Box action space"):
        make(TD3, env=gym.make("CartPole-v1"))
    with pytest.raises(ConfigurationError, match="algorithm 'dqn' cannot be built with these settings"):
        make(DQN, env=gym.make("Pendulum-v1"))


def test_a_trained_model_only_predicts(make: Make, tmp_path: Path) -> None:
    make(A2C).train()
    trained = A2C.load_trained(tmp_path / "models" / "trained_model")
    for act in (trained.train, trained.save_model, trained.save_replay_buffer, trained.set_model_logger):
        with pytest.raises(RunError, match="loaded for prediction only"):
            act()
    with pytest.raises(CheckpointError, match="a model of 'a2c', not of 'ppo'"):
        PPO.load_trained(tmp_path / "models" / "trained_model")
    with pytest.raises(ConfigurationError, match="the environment has"):
        A2C.load_trained(tmp_path / "models" / "trained_model", gym.make("CartPole-v1"))
    with pytest.raises(CheckpointError, match="does not exist"):
        A2C.load_trained(tmp_path / "models" / "nothing")
    assert trained.close_env()


def test_a_replay_buffer_is_saved_only_after_a_training(make: Make) -> None:
    with pytest.raises(NotTrainedError, match=r"call train\(\) first"):
        make(TD3).save_replay_buffer()
    with pytest.raises(ConfigurationError, match="A2C has no replay buffer"):
        make(A2C).save_replay_buffer()


@pytest.mark.needs("sb3_contrib")
def test_a_mask_begins_episodes_of_a_recurrent_policy(tmp_path: Path) -> None:
    class RecurrentPPO(BasicModel):
        algorithm = "recurrent_ppo"

    model = RecurrentPPO.load_trained(stock_models.write("recurrent_ppo", tmp_path), gym.make("Pendulum-v1"))
    observation = np.ones(3, np.float32)
    first, state = model.predict(observation, deterministic=True)
    second, _ = model.predict(observation, state, mask=np.array([False]), deterministic=True)
    begun, _ = model.predict(observation, state, mask=np.array([True]), deterministic=True)
    np.testing.assert_array_equal(first, begun)
    assert not np.array_equal(first, second)


class Broken(gym.Env[Any, Any]):
    """Its observations are not in its space."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (3,))
    action_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        return np.full(3, 9.0, np.float32), {}


def test_check_env_tells_whether_the_environment_is_right(make: Make, caplog: pytest.LogCaptureFixture) -> None:
    assert make(A2C, env=gym.make("frobs_core:frobs/Irb120Reach-v0")).check_env() is True
    assert make(A2C, env=Broken(), log_folder="next").check_env() is False
    assert "failed the environment check of stable-baselines3" in caplog.text
