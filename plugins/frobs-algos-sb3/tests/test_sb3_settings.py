from __future__ import annotations

import inspect
import sys
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from frobs_cli.parameters import descriptions
from frobs_core import plugins
from frobs_core.util.errors import ConfigurationError, PluginError, UnknownParameterError

NAMES = ("ppo", "a2c", "ddpg", "dqn", "sac", "td3", "tqc", "crossq", "recurrent_ppo")
NO_SETTINGS = {
    "self", "policy", "env", "seed", "verbose", "tensorboard_log", "stats_window_size", "_init_setup_model",  # the run's
    "rollout_buffer_class", "rollout_buffer_kwargs", "replay_buffer_class", "replay_buffer_kwargs",  # by 'replay_buffer'
}  # fmt: skip
OURS = {
    "scale_observation", "normalize_observation", "normalize_reward", "clip_observation", "clip_reward", "torch_threads",
    "replay_buffer", "demonstrations", "demonstration_episodes", "demonstration_mapping", "initial_policy", "initial_episodes", "initial_updates",
}  # fmt: skip
NO_NETWORK_SETTINGS = {
    "self",
    "observation_space",
    "action_space",
    "lr_schedule",
    "use_sde",
    "features_extractor_kwargs",
}
CHOSEN_LATER = {"net_arch", "features_extractor_class", "optimizer_class", "activation_fn", "lstm_kwargs", "n_critics"}


@pytest.mark.parametrize("name", NAMES)
def test_settings_and_their_defaults_are_those_of_stable_baselines3(name: str) -> None:
    cls = plugins.get_record("algorithm", name).load()
    theirs = inspect.signature(cls.model_class.__init__).parameters
    ours = cls.resolve_config({}).model_dump()
    assert set(ours) - OURS == set(theirs) - NO_SETTINGS
    different = {
        key: (value, theirs[key].default)
        for key, value in ours.items()
        if key not in OURS | {"policy_kwargs", "device"} and value != theirs[key].default
    }
    assert not different


@pytest.mark.parametrize("name", NAMES)
def test_every_setting_is_explained(name: str) -> None:
    def unexplained(model: type[BaseModel]) -> list[str]:
        known = descriptions(model)
        own = [f"{model.__name__}.{key}" for key in model.model_fields if key not in known]
        parts = [
            part for field in model.model_fields.values() for part in (field.annotation, *get_args(field.annotation))
        ]
        models = [part for part in parts if isinstance(part, type) and issubclass(part, BaseModel)]
        return own + [key for inner in models for key in unexplained(inner)]

    assert not unexplained(plugins.get_record("algorithm", name).load().config_model)


@pytest.mark.parametrize("name", NAMES)
def test_networks_and_their_defaults_are_those_of_stable_baselines3(name: str) -> None:
    cls = plugins.get_record("algorithm", name).load()
    policy = "MlpLstmPolicy" if name == "recurrent_ppo" else "MlpPolicy"
    theirs = inspect.signature(cls.model_class.policy_aliases[policy].__init__).parameters
    ours = cls.resolve_config({}).policy_kwargs.model_dump()
    assert set(ours) == set(theirs) - NO_NETWORK_SETTINGS - {"lstm_kwargs"}
    different = {
        key: (value, theirs[key].default)
        for key, value in ours.items()
        if key not in CHOSEN_LATER and value != theirs[key].default
    }
    assert not different


@pytest.mark.parametrize(("name", "environment"), [("ddpg", "Pendulum-v1"), ("dqn", "CartPole-v1")])
def test_the_networks_are_those_that_stable_baselines3_builds_by_default(
    name: str, environment: str, make: Any
) -> None:
    cls = plugins.get_record("algorithm", name).load()
    built = cls(make(environment, 1), {}, 0).model
    theirs = cls.model_class("MlpPolicy", environment, device="cpu")
    assert str(built.policy) == str(theirs.policy)


@pytest.mark.parametrize(
    ("name", "config", "error", "message"),
    [
        ("sac", {"action_noise": {"sigm": 1}}, UnknownParameterError, "'action_noise' of .* Did you mean 'sigma'"),
        ("sac", {"train_freq": {"frequenc": 1}}, UnknownParameterError, "Did you mean 'frequency'"),
        ("sac", {"train_freq": 0}, ConfigurationError, "train_freq is 0"),
        ("sac", {"replay_buffer": {"n_goals": 1}}, UnknownParameterError, "Did you mean 'n_sampled_goal'"),
        ("sac", {"ent_coef": "auto_-1"}, ConfigurationError, "'auto_'"),
        ("sac", {"ent_coef": "auto_0"}, ConfigurationError, "'auto_'"),
        ("sac", {"ent_coef": -0.1}, ConfigurationError, "must be ≥ 0"),
        ("sac", {"optimize_memory_usage": True}, ConfigurationError, "handle_timeout_termination: false"),
        ("sac", {"policy_kwargs": {"net_arch": {"vf": [8]}}}, ConfigurationError, "net_arch"),
        ("td3", {"use_sde": True}, UnknownParameterError, "use_sde"),
        ("td3", {"policy_kwargs": {"optimizer_class": "Adm"}}, ConfigurationError, "'Adam'"),
        ("dqn", {"action_noise": {}}, UnknownParameterError, "action_noise"),
        ("dqn", {"policy_kwargs": {"net_arch": {"qf": [8]}}}, ConfigurationError, "net_arch"),
        ("a2c", {"policy_kwargs": {"squash_output": True}}, ConfigurationError, "use_sde: true"),
        ("recurrent_ppo", {"policy_kwargs": {"shared_lstm": True}}, ConfigurationError, "enable_critic_lstm: false"),
    ],
)
def test_a_bad_setting_of_any_algorithm_is_named(
    name: str, config: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        plugins.get_record("algorithm", name).load().resolve_config(config)


def test_optimizer_activation_and_extractor_go_by_name(make: Any) -> None:
    from stable_baselines3.common.torch_layers import CombinedExtractor
    from torch import nn, optim

    kwargs = {
        "net_arch": {"pi": [8], "qf": [16, 16]},
        "activation_fn": "elu",
        "features_extractor_class": "CombinedExtractor",
        "optimizer_class": "RMSprop",
        "optimizer_kwargs": {"alpha": 0.9},
    }
    env = make("frobs/Irb120ReachGoal-v0", 1)
    model = plugins.get_record("algorithm", "td3").load()(env, {"buffer_size": 200, "policy_kwargs": kwargs}, 0).model
    assert isinstance(model.actor.optimizer, optim.RMSprop)
    assert model.critic.optimizer.param_groups[0]["alpha"] == 0.9
    assert isinstance(model.actor.features_extractor, CombinedExtractor)
    widths = [layer.out_features for layer in model.critic.q_networks[0] if isinstance(layer, nn.Linear)]
    assert widths == [16, 16, 1]
    assert any(isinstance(layer, nn.ELU) for layer in model.actor.mu)


def test_schedules_fall_over_the_whole_training(make: Any, monitor: Any) -> None:
    config = {"learning_rate": "lin_1e-2", "learning_starts": 0, "batch_size": 4, "buffer_size": 100}
    plugins.get_record("algorithm", "td3").load()(make("Pendulum-v1", 2), config, 0).train(20, monitor)
    rates = [metrics["td3/learning_rate"] for _, metrics in monitor.rows]
    assert rates == pytest.approx([1e-2 * (1 - steps / 20) for steps in range(2, 22, 2)])


def test_a_schedule_does_not_fall_below_zero_in_the_last_rollout(make: Any, monitor: Any) -> None:
    config = {"learning_rate": "lin_1e-2", "n_steps": 16, "batch_size": 8}
    plugins.get_record("algorithm", "ppo").load()(make("Pendulum-v1", 2), config, 0).train(20, monitor)
    assert [metrics["ppo/learning_rate"] for _, metrics in monitor.rows] == [0.0]


@pytest.mark.parametrize("rate", ["lin_nan", "lin_inf", float("inf"), float("nan")])
def test_a_schedule_begins_with_a_finite_number(rate: Any) -> None:
    with pytest.raises(ConfigurationError, match="learning_rate"):
        plugins.get_record("algorithm", "ppo").load().resolve_config({"learning_rate": rate})


@pytest.mark.parametrize("name", ["tqc", "crossq", "recurrent_ppo"])
def test_without_sb3_contrib_one_error_says_how_to_install_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    record = plugins.get_record("algorithm", name)
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)
    monkeypatch.delitem(sys.modules, f"frobs_algos_sb3.{name}", raising=False)
    with pytest.raises(PluginError, match=r"sb3_contrib.*pip install .*frobs-algos-sb3\[contrib\]'"):
        record.load()
