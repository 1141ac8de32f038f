"""Checks that randomisation keeps the laws of an environment: all of it comes from the seed, and a snapshot has it."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from typing import Any

import gymnasium as gym

from frobs_core import plugins
from frobs_core.capabilities import Level
from frobs_core.interfaces import CommandMode
from frobs_core.randomization import CAPABILITY, find_terms, find_units
from frobs_core.specs import SimulatorRecord
from frobs_devkit.testing.checks import Outcome
from frobs_devkit.testing.environment import seeding, state, vector
from frobs_devkit.testing.environment.subject import OTHER, EnvUnderTest, inside, is_ours

_PHYSICS: Mapping[str, Mapping[str, Any]] = {
    "mass": {"target": "*", "scale": [0.8, 1.2]},
    "friction": {"scale": {"log_uniform": [0.5, 2.0]}},
    "stiffness": {"scale": {"normal": 0.1}, "when": "start"},
    "damping": {"scale": [0.8, 1.2], "shared": True},
    "joint_damping": {"add": [0.0, 0.01], "every": 7},
    "gravity": {"add": {"normal": 0.05}, "every": [3, 9]},
}


def randomized_equals_single(subject: EnvUnderTest) -> Outcome:
    """With everything randomised too, each environment of a batch equals the single one, reset at times of its own."""
    randomized = _randomize_everything(subject)
    return OTHER if randomized is None else vector.disabled_equals_single(randomized)


def randomized_state_is_complete(subject: EnvUnderTest) -> Outcome:
    """With everything randomised too, a snapshot continues exactly, and a reset with a seed forgets what was before."""
    randomized = _randomize_everything(subject)
    if randomized is None:
        return OTHER
    return state.snapshot_continues(randomized) or seeding.reset_forgets_history(randomized)


def _randomize_everything(subject: EnvUnderTest) -> EnvUnderTest | None:
    """Return the same with all randomised that its simulator can, unless it randomises already; None: not ours."""
    with closing(subject.make()) as env:
        if not is_ours(env):
            return None
        if inside(env).randomization is not None:
            return subject
        return EnvUnderTest(subject.id, {**subject.kwargs, "randomize": _everything(subject, inside(env))})


def _everything(subject: EnvUnderTest, env: Any) -> dict[str, Any]:
    name = {"simulator": "mujoco", **subject.spec.kwargs, **subject.kwargs}["simulator"]
    record = plugins.get_record("simulator", name)
    assert isinstance(record, SimulatorRecord)
    mode = env.robot.command_mode
    without_effect = {"stiffness": mode is not CommandMode.POSITION, "damping": mode is CommandMode.EFFORT}
    found: dict[str, Any] = {
        parameter: dict(setting)
        for parameter, setting in _PHYSICS.items()
        if record.capabilities.get(CAPABILITY[parameter], Level.UNSUPPORTED)
        and not without_effect.get(parameter, False)
        and find_units(env.simulation, parameter)
    }
    noisy = [name for name, term in find_terms(env.task).items() if _is_vector(env.observation_space, term.key)]
    if noisy:
        found["observation_noise"] = {name: {"normal": 0.01} for name in noisy}
        found["observation_delay"] = {"steps": [0, 2], "target": noisy}
    return {**found, "action_delay": {"steps": [0, 2]}}


def _is_vector(space: gym.Space[Any], key: str) -> bool:
    box = space[key] if isinstance(space, gym.spaces.Dict) else space
    return isinstance(box, gym.spaces.Box) and len(box.shape) == 1 and box.dtype.kind == "f"
