"""A check of an environment whose robot has sensors: they may be bad ones."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import Any

from frobs_core.interfaces import Bumper, Sensor
from frobs_devkit.testing.checks import NotApplicable, Outcome
from frobs_devkit.testing.environment import state, vector
from frobs_devkit.testing.environment.subject import OTHER, EnvUnderTest, inside, is_ours


def sensors_may_be_bad(subject: EnvUnderTest) -> Outcome:
    """With noise, delay and losses in every sensor, environments of a batch equal single ones, and snapshots continue."""
    with closing(subject.make()) as env:
        if not is_ours(env):
            return OTHER
        there = inside(env).robot.robot.sensors
        bad = {name: _spoil(sensor, inside(env).control_timestep) for name, sensor in there.items()}
    if not bad:
        return NotApplicable("the robot has no sensor")
    spoiled = EnvUnderTest(subject.id, {**subject.kwargs, "sensors": bad})
    return vector.disabled_equals_single(spoiled) or state.snapshot_continues(spoiled)


def _spoil(sensor: Sensor, control_timestep: float) -> Sensor:
    faults: dict[str, Any] = {"delay": 2.0 * control_timestep, "dropout": 0.2}
    if not isinstance(sensor, Bumper):
        faults["noise"] = 0.01
    return replace(sensor, **faults)
