"""Tests of the robot: the conformance checks and your own tests."""

{% if cookiecutter.what == "robot" and cookiecutter.example == "wheeled" %}
from frobs_devkit.testing import check_controller, check_plugin, check_robot, pytest_checks
{% elif cookiecutter.what == "robot" %}
import gymnasium as gym

from frobs_devkit.testing import check_plugin, check_robot, pytest_checks
{% else %}
from frobs_devkit.testing import check_plugin, check_robot, pytest_checks
{% endif %}

test_plugin = pytest_checks(check_plugin("{{ distribution.removeprefix('frobs-').replace('-', '_') }}"))

{% set robot = robot_file() if cookiecutter.example == "file" else none %}
{% if robot and robot.expected_failures %}
# Conformance checks that the model file fails. After you fix a problem, remove its line; otherwise, the test fails.
EXPECTED_FAILURES = {
{% for check, reason in robot.expected_failures.items() %}
    {{ check | literal }}: {{ reason | literal }},
{% endfor %}
}

test_robot = pytest_checks(
    check_robot("{{ cookiecutter.name }}", simulators=["mujoco"]), expected_failures=EXPECTED_FAILURES
)
{% else %}
test_robot = pytest_checks(check_robot("{{ cookiecutter.name }}", simulators=["mujoco"]))
{% endif %}
{% if cookiecutter.what == "robot" and cookiecutter.example == "wheeled" %}

test_drive = pytest_checks(check_controller("differential_drive", robot="{{ cookiecutter.name }}"))
{% elif cookiecutter.what == "robot" %}


def test_it_can_reach() -> None:
    env = gym.make("frobs_core:frobs/Reach-v0", robot="{{ cookiecutter.name }}")
    observation, _ = env.reset(seed=0)
    for _ in range(10):
        observation, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(observation)
    env.close()
{% endif %}
