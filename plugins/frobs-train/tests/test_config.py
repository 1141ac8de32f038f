from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from frobs_cli.errors import CommandLineError
from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import (
    ConfigFileError,
    ConfigurationError,
    FrobsError,
    UnknownNameError,
    UnknownParameterError,
)
from frobs_train import decide_threads, resolve_config
from frobs_train.cli.train import _advise_controller

REACH = "frobs/Irb120Reach-v0"
TOOL, JOINT = "tcp_delta_position", "joint_delta_position"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "config.yaml"
    path.write_text(
        "environment: Pendulum-v1\nsteps: 2000\nalgorithm_config:\n  gamma: 0.9\n  n_steps: 16\n"
        "controllers:\n  tcp_delta_position:\n    steps: 3000\n"
    )
    return path


def test_defaults_of_the_algorithm_are_filled_in() -> None:
    config = resolve_config("Pendulum-v1")
    assert config.algorithm == "ppo"
    assert config.algorithm_config["clip_range"] == 0.2
    assert config.algorithm_config["torch_threads"] == 1
    assert config.algorithm_config["policy_kwargs"]["net_arch"] == [64, 64]


def test_what_is_resolved_stays_as_it_is() -> None:
    config = resolve_config("Pendulum-v1", settings=["algorithm_config.learning_rate=lin_3e-4"])
    again = resolve_config("Pendulum-v1", flags={"algorithm_config": config.algorithm_config})
    assert again == config


def test_tuned_settings_are_below_everything_else() -> None:
    tuned = resolve_config(REACH)
    assert tuned.total_envs > 8
    assert tuned.algorithm_config["policy_kwargs"]["activation_fn"] == "elu"
    changed = resolve_config(f"frobs_core:{REACH}", flags={"num_envs": 3}, settings=["algorithm_config.gamma=0.5"])
    assert changed.num_envs == 3
    assert changed.algorithm_config == {**tuned.algorithm_config, "gamma": 0.5}


@pytest.mark.parametrize(
    ("id", "algorithm"),
    [("frobs/PandaPushVision-v0", "dagger"), ("frobs/Irb120ReachGoal-v0", "sac"), ("Pendulum-v1", "ppo")],
)
def test_the_record_of_an_id_chooses_the_algorithm(id: str, algorithm: str) -> None:
    config = resolve_config(f"frobs_core:{id}" if id.startswith("frobs/") else id)
    assert config.algorithm == algorithm
    assert config == resolve_config(config.environment, flags={"algorithm": algorithm})
    assert resolve_config(id, settings=["algorithm=a2c"]).algorithm == "a2c"


def test_the_algorithm_of_each_id_is_tuned_for_it() -> None:
    for id, (_, record) in registry.environments().items():
        tuned = [name for name, each in plugins.records(AlgorithmRecord).items() if id in each.tuned]
        assert record.algorithm in tuned or not tuned, id


def test_the_number_on_each_simulator_replaces_that_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mixed.yaml"
    file.write_text("num_envs: {gazebo: 2, mujoco: 3}\n", "utf-8")
    assert resolve_config(REACH, file=file).simulators == ("gazebo", "mujoco")
    config = resolve_config(REACH, file=file, flags={"num_envs": "pybullet=1,mujoco=2"})
    assert list(config.num_envs.items()) == [("pybullet", 1), ("mujoco", 2)]  # type: ignore[union-attr]
    assert config.total_envs == 3
    assert config.environment_kwargs["simulator"] == "pybullet"
    assert resolve_config(REACH, file=file, flags={"num_envs": "4"}).num_envs == 4


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ({"num_envs": "mujoco=2,"}, "neither a whole number"),
        ({"num_envs": "mujoco=2,mujoco=3"}, "neither a whole number"),
        ({"num_envs": {"mujoco": 0}}, r"num_envs\.mujoco is 0"),
        ({"num_envs": {}}, "num_envs is {}"),
        ({"num_envs": {"mujoco": 1}, "simulator": "pybullet"}, "'pybullet', which is not a simulator of num_envs"),
        ({"num_envs": {"mujoco": 1, "havok": 1}}, "havok"),
    ],
)
def test_wrong_numbers_of_environments_are_explained(flags: dict[str, Any], message: str) -> None:
    with pytest.raises(FrobsError, match=message):
        resolve_config(REACH, flags=flags, check_parts=True)


def test_a_controller_picks_its_section_of_the_tuned_file() -> None:
    joint, tool = resolve_config(REACH), resolve_config(REACH, flags={"controller": "tcp_delta_position"})
    assert tool.environment_kwargs == {"controller": "tcp_delta_position"}
    assert tool.steps < joint.steps
    assert tool.algorithm_config["policy_kwargs"]["activation_fn"] == "elu"
    assert (
        tool.algorithm_config["policy_kwargs"]["net_arch"]
        == [64, 64]
        != joint.algorithm_config["policy_kwargs"]["net_arch"]
    )


def test_advice_names_the_controller_that_learns_in_fewer_steps() -> None:
    def advice(id: str, **flags: str) -> str | None:
        return _advise_controller(resolve_config(id, flags=flags))

    tool, joint = (resolve_config("frobs/Reach-v0", flags={"controller": name}).steps for name in (TOOL, JOINT))
    for id in ("frobs/Reach-v0", "frobs_core:frobs/Reach-v0"):
        assert advice(id, controller=JOINT) == (
            f"Training is faster with '--controller {TOOL}', which needs {tool:,} steps; '{JOINT}' needs {joint:,}."
        )
    assert advice("frobs/Reach-v0", controller=TOOL) is None
    assert advice("frobs/Reach-v0") is None
    assert advice("frobs/Reach-v0", controller=JOINT, algorithm="sac") is None  # nothing is tuned
    assert advice(REACH, controller=TOOL) is None
    assert advice("Pendulum-v1", controller=JOINT) is None


def test_settings_win_over_flags_and_flags_over_the_file(file: Path) -> None:
    config = resolve_config(file=file, flags={"steps": 4000, "seed": None}, settings=["steps=5000"])
    assert (config.environment, config.steps, config.seed) == ("Pendulum-v1", 5000, None)
    assert resolve_config(file=file, flags={"steps": 4000}).steps == 4000
    assert resolve_config(file=file).algorithm_config["n_steps"] == 16


def test_a_file_may_have_sections_for_controllers(file: Path) -> None:
    assert resolve_config(file=file).steps == 2000
    assert resolve_config(file=file, settings=["environment_kwargs.controller=tcp_delta_position"]).steps == 3000


def test_a_robot_file_is_found_again_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "arm.urdf").touch()
    monkeypatch.chdir(tmp_path)
    named = resolve_config(REACH, flags={"robot": "irb120", "tcp": "tool0"}).environment_kwargs
    assert named == {"robot": "irb120", "tcp": "tool0"}
    assert resolve_config(REACH, flags={"robot": "arm.urdf"}).environment_kwargs == {
        "robot": str(tmp_path / "arm.urdf")
    }


def test_a_setting_deep_inside_is_set() -> None:
    config = resolve_config("Pendulum-v1", settings=["algorithm_config.policy_kwargs.net_arch=[8, 8]"])
    assert config.algorithm_config["policy_kwargs"]["net_arch"] == [8, 8]


def test_a_configuration_is_frozen() -> None:
    with pytest.raises(ValidationError):
        resolve_config("Pendulum-v1").steps = 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param("stepz: 3\n", r"bad\.yaml:1: the run configuration has no parameter 'stepz'.*'steps'", id="key"),
        pytest.param("steps: -5\n", r"bad\.yaml:1: .*steps is -5; .*greater than or equal to 1", id="negative steps"),
        pytest.param(
            "steps: 5\nalgorithm_config:\n  n_step: 3\n",
            r"bad\.yaml:3: algorithm 'ppo' .*'n_step'.*'n_steps'",
            id="ppo",
        ),
        pytest.param(
            "algorithm_config:\n  policy_kwargs:\n    net_ark: [3]\n", r"bad\.yaml:3: .*'net_ark'.*'net_arch'", id="net"
        ),
        pytest.param("algorithm_config:\n  gamma: 2\n", r"bad\.yaml:2: algorithm 'ppo': gamma is 2", id="value"),
        pytest.param("algorithm_config:\n  learning_rate: lin_x\n", r"bad\.yaml:2: .*'lin_'", id="schedule"),
        pytest.param("algorithm_config: 3\n", r"bad\.yaml:1: .*algorithm_config is 3", id="no mapping"),
        pytest.param("controllers: 3\n", r"bad\.yaml:1: 'controllers' must contain", id="sections"),
    ],
)
def test_a_mistake_in_a_file_is_named_with_its_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(ConfigFileError, match=message):
        resolve_config("Pendulum-v1", file=path)


@pytest.mark.parametrize(
    ("setting", "error", "message"),
    [
        ("stepz=3", CommandLineError, "Did you mean 'steps'"),
        ("algorithm_config.n_step=3", UnknownParameterError, "Did you mean 'n_steps'"),
        ("algorithm_config.policy_kwargs.activation=relu", UnknownParameterError, "Did you mean 'activation_fn'"),
        ("steps", ConfigurationError, "must have the form key=value"),
        ("=3", ConfigurationError, "must have the form key=value"),
        ("steps.deeper=3", ConfigurationError, "steps is "),
        ("steps=[1", ConfigFileError, "not valid YAML"),
        ("algorithm_config.policy_kwargs.activation_fn=softplus", ConfigurationError, "'relu'"),
    ],
)
def test_a_mistake_in_a_setting_is_named(setting: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        resolve_config("Pendulum-v1", settings=[setting])


def test_a_setting_without_its_section_names_the_sections() -> None:
    with pytest.raises(
        CommandLineError, match=r"algorithm_config\.learning_rate=VALUE .* environment_kwargs\.learning"
    ):
        resolve_config("Pendulum-v1", settings=["learning_rate=0.1"])


def test_an_unknown_algorithm_names_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'ppo'"):
        resolve_config("Pendulum-v1", flags={"algorithm": "pppo"})


def test_an_environment_is_needed() -> None:
    with pytest.raises(ConfigurationError, match="needs environment"):
        resolve_config()


@pytest.mark.parametrize("threads", [".inf", "1.5", "[1]", "many"])
def test_threads_that_are_no_whole_number_are_named(threads: str) -> None:
    config = resolve_config("frobs/Irb120Reach-v0", settings=[f"environment_kwargs.num_threads={threads}"])
    with pytest.raises(ConfigurationError, match=r"environment_kwargs\.num_threads is"):
        decide_threads(config)
