"""Tests of the {{ kinds }}: the conformance checks and your own tests."""

{% if kinds != "algorithm" %}
import gymnasium as gym

{% endif %}
from frobs_devkit.testing import {{ ", ".join(["check_" ~ kinds, "check_plugin"] | sort) }}, pytest_checks

test_plugin = pytest_checks(check_plugin("{{ distribution.removeprefix('frobs-').replace('-', '_') }}"))
test_{{ kinds }} = pytest_checks(check_{{ kinds }}("{{ cookiecutter.name }}"))
{% if kinds != "algorithm" %}


def test_an_arm_reaches_with_it() -> None:
    env = gym.make("frobs_core:frobs/Irb120Reach-v0", {{ kinds }}="{{ cookiecutter.name }}")
    env.reset(seed=0)
    for _ in range(10):
        observation, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(observation)
    env.close()
{% endif %}
