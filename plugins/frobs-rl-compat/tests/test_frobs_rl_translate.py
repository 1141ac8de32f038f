from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.util.errors import ConfigFileError, ConfigurationError
from frobs_rl_compat.training.config_files import DEFAULTS
from frobs_rl_compat.training.settings import CONFIGS
from frobs_train import RunConfig, resolve_config, train

REACH = "frobs/Irb120Reach-v0"


def resolve(path: Path, algorithm: str | None = None, **flags: object) -> RunConfig:
    return resolve_config(REACH, file=path, flags={"algorithm": algorithm, **flags})


def changed(algorithm: str, folder: Path, *replacements: tuple[str, str]) -> Path:
    text = (DEFAULTS / f"{algorithm}_config.yaml").read_text()
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    path = folder / "changed.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("algorithm", CONFIGS)
def test_every_algorithm_trains_on_a_robot_from_frobs_rl_s_own_default_file(algorithm: str, tmp_path: Path) -> None:
    flags = {"controller": "discrete"} if algorithm == "dqn" else {}
    config = resolve(DEFAULTS / f"{algorithm}_config.yaml", **flags)
    assert (config.algorithm, config.num_envs, config.steps, config.checkpoint_every) == (algorithm, 1, 5000, 1000)
    run = train(config.model_copy(update={"steps": 120, "seed": 0}), tmp_path / "run")
    assert run.checkpoints[-1].steps >= 120


def test_a_file_stands_for_itself(caplog: pytest.LogCaptureFixture) -> None:
    config = resolve(DEFAULTS / "ppo_config.yaml")
    own = config.algorithm_config
    assert own["policy_kwargs"]["net_arch"] == [64, 64]  # stable-baselines3's, not what was tuned for the ID
    assert (own["n_steps"], own["batch_size"], own["scale_observation"]) == (100, 100, False)
    assert len(caplog.records) == 1
    assert "a run chooses its own file names and logs" in caplog.text
    assert "log_folder, log_interval" in caplog.text


def test_noise_networks_and_frequencies_come_over(tmp_path: Path) -> None:
    path = changed(
        "sac", tmp_path, ("use_sde: True", "use_sde: False"), ("sigma: 0.01", "sigma: 0.3"), ("unit: step ", "unit: episode "),
        ("use_custom_policy: False", "use_custom_policy: True"), ("activation_fn: relu", "activation_fn: ELU"),
    )  # fmt: skip
    own = resolve(path).algorithm_config
    assert own["action_noise"]["sigma"] == 0.3
    assert own["train_freq"] == {"frequency": 20, "unit": "episode"}
    assert own["policy_kwargs"]["activation_fn"] == "elu"
    assert own["policy_kwargs"]["net_arch"] == [400, 300]
    assert resolve(DEFAULTS / "sac_config.yaml").algorithm_config["action_noise"] is None  # state-dependent instead


def test_flags_outrank_the_file(tmp_path: Path) -> None:
    assert resolve(DEFAULTS / "td3_config.yaml", steps=7, num_envs=3).steps == 7


def test_a_file_of_another_algorithm_than_asked_for_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigFileError, match=r"has the layout of td3, not of 'ppo'; omit --algorithm"):
        resolve(DEFAULTS / "td3_config.yaml", "ppo")
    both = changed("td3", tmp_path, ("  # TD3\n", "  ddpg_params: {}\n"))
    with pytest.raises(ConfigFileError, match=r"use this file layout: ddpg, td3; choose one with --algorithm"):
        resolve(both)
    assert resolve(both, "ddpg").algorithm == "ddpg"


def test_mistakes_are_named_with_file_and_line(tmp_path: Path) -> None:
    path = changed("td3", tmp_path, ("policy_delay", "policy_dely"))
    with pytest.raises(ConfigFileError, match=r"changed\.yaml:\d+: .*Did you mean 'policy_delay'"):
        resolve(path)


def test_a_file_that_goes_on_from_a_model_is_refused(tmp_path: Path) -> None:
    path = changed("td3", tmp_path, ("load_model: False", "load_model: True"))
    with pytest.raises(ConfigurationError, match=r"load_model is not supported here.*training\.TD3"):
        resolve(path)
