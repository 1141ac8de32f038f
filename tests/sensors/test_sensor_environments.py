"""Environments whose robot has sensors, and what users say of them."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import seeing

from frobs_core.description import Imu, Lidar
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.sensing.sensors.settings import apply_settings
from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownNameError, UnknownParameterError
from frobs_core.util.yaml import load_yaml
from frobs_devkit.testing import CheckFailure, check_env, run_checks
from frobs_train.configuration.resolve import resolve_config

BAD = {
    "scan": {"rays": 8, "noise": 0.05, "dropout": 0.1, "delay": 0.1},
    "imu": {"noise": [0.1, 0.1, 0.1, 0.3, 0.3, 0.3], "rate": 5.0},
    "bumper": {"dropout": 0.3},
}


@pytest.fixture(params=["mujoco", "pybullet"])
def simulator(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def actions() -> Any:
    return np.random.default_rng(0).uniform(-0.3, 1.0, (25, 3, 2))


def test_environments_of_a_vector_equal_single_ones_with_bad_sensors(simulator: str, actions: Any) -> None:
    keywords = {**seeing.PARTS, "sensors": BAD, "simulator": simulator, "num_threads": 1}
    with closing(RobotVectorEnv(3, max_episode_steps=10, autoreset_mode="Disabled", **keywords)) as env:
        together = [env.reset(seed=5)[0].copy()]
        together += [env.step(action)[0].copy() for action in actions[:10]]
    for i in range(3):
        with closing(RobotEnv(**keywords)) as single:
            alone = [single.reset(seed=5 + i)[0]] + [single.step(action[i])[0] for action in actions[:10]]
        np.testing.assert_array_equal(np.stack(together)[:, i], np.stack(alone))


def check(name: str, of: str) -> Any:
    return next(check for check in check_env(f"seeing:seeing/{of}-v0") if check.name == name)


@pytest.mark.slow
def test_the_kit_passes_a_task_that_takes_bad_sensors() -> None:
    check("sensors_may_be_bad", "Seeing").run()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Forgetful", "Careless"])
def test_the_kit_catches_a_task_that_is_right_with_ideal_sensors_only(name: str) -> None:
    with pytest.raises(CheckFailure):
        check("sensors_may_be_bad", name).run()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Careless", "Forgetful"])
def test_no_other_check_catches_it(name: str) -> None:
    def failed(of: str) -> set[str]:
        return {result.name for result in run_checks(check_env(f"seeing:seeing/{of}-v0")).failed}

    # Of this little task a few are true by itself: no other process knows it, and velocities have no bounds.
    assert failed(name) - failed("Seeing") == {"sensors_may_be_bad"}


def test_the_bumper_closes_at_a_wall_and_the_lidar_sees_it(simulator: str) -> None:
    with closing(RobotEnv(**seeing.PARTS, simulator=simulator)) as env:
        env.reset(seed=0)
        read = env.task.sensors.read
        assert read("bumper").item() == 0.0
        env.robot.write_base_pose(np.array([[0.375, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]]))  # almost there
        for _ in range(10):
            env.step(np.array([1.0, 0.0]))
        assert read("bumper").item() == 1.0
        assert read("scan").min() < 0.2
        assert env.reset(seed=1)[0][-1] == 0.0


def test_fields_of_a_sensor_are_replaced() -> None:
    with closing(RobotEnv(**seeing.PARTS, sensors={"scan": {"rays": 4}, "imu": None})) as env:
        assert env.observation_space.shape == (5,)
        assert env.robot.robot.sensors["scan"].range_max == 3.0
    assert len(seeing.ROVER.sensors) == 3  # the robot's own description stays


def test_gym_make_takes_them() -> None:
    with closing(gym.make("seeing:seeing/Seeing-v0", sensors={"scan": {"rays": 4}})) as env:
        assert env.observation_space.shape == (11,)


def test_a_robot_that_is_a_file_can_be_given_sensors() -> None:
    new = {"scan": {"type": "lidar", "frame": "base_link", "rays": 5, "range_min": 0.1, "range_max": 4.0}}
    keywords = {"task": "reach", "robot": "frobs_robots_abb:models/irb120.urdf.xacro", "tcp": "tool0"}
    with closing(RobotEnv(**keywords, controller="joint_velocity", sensors={**new, "imu": Imu(frame="tool0")})) as env:
        assert list(env.robot.robot.sensors) == ["scan", "imu"]
        env.reset(seed=0)
        assert env.robot.lidar("scan").shape == (1, 5)


def test_a_configuration_sets_one_field(tmp_path: Path) -> None:
    file = tmp_path / "run.yaml"
    file.write_text("environment_kwargs:\n  sensors:\n    scan: {type: imu, frame: link_6, noise: 0.1}\n")
    config = resolve_config(
        environment="frobs/Irb120Reach-v0", file=file, settings=["environment_kwargs.sensors.scan.noise=0.02"]
    )
    with closing(gym.make("frobs_core:frobs/Irb120Reach-v0", **config.keywords())) as env:
        assert env.unwrapped.robot.robot.sensors == {"scan": Imu(frame="link_6", noise=0.02)}


OWN = {"scan": Lidar(frame="hull", rays=4, range_min=0.1, range_max=2.0)}


@pytest.mark.parametrize(
    ("given", "error", "text"),
    [
        ({"scam": {"rays": 3}}, UnknownNameError, "Did you mean 'scan'"),
        ({"scam": None}, UnknownNameError, "Did you mean 'scan'"),
        ({"scan": {"noize": 0.1}}, UnknownParameterError, "sensor 'scan' .*Did you mean 'noise'"),
        ({"scan": {"rays": 0}}, ConfigurationError, "sensors.scan: a lidar on 'hull': rays is 0"),
        ({"scan": 0.1}, ConfigurationError, "sensors.scan is 0.1"),
        ({"x": {"type": "lydar", "frame": "hull"}}, UnknownNameError, "Did you mean 'lidar'"),
        ({"x": {"type": "lidar", "frame": "hull"}}, ConfigurationError, "needs rays, range_min, range_max"),
        ({"x": {"type": "imu", "frame": "hull", "noize": 1}}, UnknownParameterError, "Did you mean 'noise'"),
        ([("scan", 1)], ConfigurationError, "it must be a mapping from sensor names to settings"),
    ],
)
def test_what_cannot_be_is_one_clear_error(given: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        apply_settings(OWN, given)


@pytest.mark.parametrize("line", ["noize: 0.1", "noise: -0.1"])
def test_a_mistake_in_a_file_is_named_with_its_line(tmp_path: Path, line: str) -> None:
    file = tmp_path / "sensors.yaml"
    file.write_text(f"scan:\n  rays: 4\n  {line}\n")
    with pytest.raises(ConfigFileError, match=r"sensors.yaml:\d: .*noi[sz]e"):
        apply_settings(OWN, load_yaml(file))


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
