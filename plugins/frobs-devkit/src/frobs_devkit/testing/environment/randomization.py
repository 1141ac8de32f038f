"""Checks that randomization and imperfect sensors depend only on the seed and are included in snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from frobs_core.contracts import CommandMode
from frobs_core.description import Bumper
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.sensing.randomization import find_units, physical_parameters
from frobs_devkit.testing.checks import NotApplicable, after
from frobs_devkit.testing.environment import seeding, vector
from frobs_devkit.testing.environment.under_test import EnvUnderTest, inside

_PHYSICS: Mapping[str, Mapping[str, Any]] = {
    "mass": {"target": "*", "scale": [0.8, 1.2]},
    "friction": {"scale": {"log_uniform": [0.5, 2.0]}},
    "stiffness": {"scale": {"normal": 0.1}, "when": "start"},
    "damping": {"scale": [0.8, 1.2], "shared": True},
    "joint_damping": {"add": [0.0, 0.01], "every": 7},
    "gravity": {"add": {"normal": 0.05}, "every": [3, 9]},
}


@after("disabled_equals_single")
def randomized_equals_single(subject: EnvUnderTest) -> None:
    """With all randomization enabled, batched and single environments are identical, even after masked resets."""
    vector.disabled_equals_single(_randomize_everything(subject))


@after("snapshot_continues", "reset_forgets_history")
def randomized_state_is_complete(subject: EnvUnderTest) -> None:
    """With all randomization enabled, a restored batch continues as before, and a seeded reset discards all history."""
    randomized = _randomize_everything(subject)
    seeding.snapshot_continues(randomized)
    seeding.reset_forgets_history(randomized)


def _randomize_everything(subject: EnvUnderTest) -> EnvUnderTest:
    """Return the subject with all supported randomization, or unchanged if it already uses randomization."""
    with subject.ours() as env:
        if inside(env).randomization is not None:
            return subject
        return EnvUnderTest(subject.id, {**subject.kwargs, "randomize": _everything(subject, inside(env))})


def _everything(subject: EnvUnderTest, env: Any) -> dict[str, Any]:
    name = {"simulator": "mujoco", **subject.spec.kwargs, **subject.kwargs}["simulator"]
    record = find_record(SimulatorRecord, name)
    mode = env.robot.command_mode
    without_effect = {"stiffness": mode is not CommandMode.POSITION, "damping": mode is CommandMode.EFFORT}
    everything: dict[str, Any] = {
        parameter: dict(setting)
        for parameter, setting in _PHYSICS.items()
        if record.capabilities.get(physical_parameters()[parameter], Level.UNSUPPORTED)
        and not without_effect.get(parameter, False)
        and find_units(env.simulation, parameter)
    }
    noisy = [name for name, term in env.observations.terms.items() if term.is_vector and not term.imperfect]
    if noisy:
        everything["observation_noise"] = {name: {"normal": 0.01} for name in noisy}
        everything["observation_delay"] = {"steps": [0, 2], "target": noisy}
    return {**everything, "action_delay": {"steps": [0, 2]}}


@after("disabled_equals_single", "snapshot_continues")
def sensors_may_be_bad(subject: EnvUnderTest) -> None:
    """With imperfect sensors, batched and single environments match, and a restored batch continues as before."""
    with subject.ours() as env:
        there = inside(env).robot.robot.sensors
        faults: dict[str, Any] = {"delay": 2.0 * inside(env).control_timestep, "dropout": 0.2}
        noises = {name: {} if isinstance(sensor, Bumper) else {"noise": 0.01} for name, sensor in there.items()}
        bad = {name: replace(sensor, **faults, **noises[name]) for name, sensor in there.items()}
    if not bad:
        raise NotApplicable("the robot has no sensors")
    spoiled = EnvUnderTest(subject.id, {**subject.kwargs, "sensors": bad})
    vector.disabled_equals_single(spoiled)
    seeding.snapshot_continues(spoiled)
