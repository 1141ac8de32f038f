"""The same steps of the same robot on two simulators: how far apart its joints are, and which one thing makes it so."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from engines import build

from frobs_core.contracts import Simulation
from frobs_core.models import JointType, RobotModel, load_model

TOLERANCE = 2.0
"""[% of the step] by which joints may be apart."""
SECONDS = 1.0
"""[s] that each response is compared for, at every fifth physics step."""
RUNS = 8
"""Joint i steps in run i modulo this: the joints of an arm one after the other, those of a humanoid in turns."""

_STEP = {JointType.PRISMATIC: 0.02}  # [m]; all others by:
_ANGLE = 0.2  # [rad]
_EVERY = 5  # physics steps between two samples


def without_self_collision(model: RobotModel, description: dict[str, object]) -> RobotModel:
    """Let all links pass through each other."""
    description["self_collision"] = False
    return model


def without_mimic(model: RobotModel, description: dict[str, object]) -> RobotModel:
    """Hold what mimics where it is."""
    return replace(
        model,
        joints=tuple(replace(j, type=JointType.FIXED, mimic=None) if j.mimic else j for j in model.joints),
    )


CAUSES: dict[str, Callable[[RobotModel, dict[str, object]], RobotModel]] = {
    "links touch": without_self_collision,
    "joints mimic": without_mimic,
}
"""What can part two engines, with what takes it away: a cause is only named where the difference goes with it."""


@dataclass(frozen=True)
class Motion:
    """How far apart the joints of a robot are.

    Attributes:
        difference: Largest of any joint at any sample [% of the joint's step]; NaN without joints.
        where: Which joint, in which run.
        causes: Which of :data:`CAUSES` it goes with, if it is above the tolerance; empty: none was found.
    """

    difference: float
    where: str = ""
    causes: tuple[str, ...] = ()


def free_motion(file: Path, simulators: tuple[str, str]) -> Motion:
    """Compare the step responses of a file's robot with the gains that nobody chose, its links colliding as loaded."""
    model = load_model(file)
    if not model.joint_names:
        return Motion(float("nan"))
    difference, where = _difference(model, simulators, {})
    if difference <= TOLERANCE:
        return Motion(difference, where)
    for causes in _combinations(model):
        description: dict[str, object] = {}
        changed = model
        for cause in causes:
            changed = CAUSES[cause](changed, description)
        if _difference(changed, simulators, description)[0] <= TOLERANCE:
            return Motion(difference, where, causes)
    return Motion(difference, where)


def _combinations(model: RobotModel) -> Iterator[tuple[str, ...]]:
    """Yield sets of causes, the smaller first."""
    mimics = any(joint.mimic for joint in model.joints)
    yield ("links touch",)
    if mimics:
        yield ("joints mimic",)
        yield ("links touch", "joints mimic")


def _difference(model: RobotModel, simulators: tuple[str, str], description: dict[str, object]) -> tuple[float, str]:
    steps = _steps(model)
    paths = []
    for simulator in simulators:
        simulation = build(simulator, model, 1, **description)
        paths.append(_paths(simulation, steps))
        simulation.close()
    share = 100.0 * np.abs(paths[0] - paths[1]) / np.abs(steps)  # (runs, samples, dof)
    share = np.nan_to_num(share, nan=np.inf)
    run, sample, joint = np.unravel_index(int(share.argmax()), share.shape)
    name, at = model.joint_names[joint], _EVERY * 0.002 * (sample + 1)
    return float(share.max()), f"{name} at {at:.2f} s, as {model.joint_names[run]} steps"


def _steps(model: RobotModel) -> np.ndarray:
    """Return how far each joint goes, (dof,): towards its farther limit, at most a quarter of the way."""
    from frobs_core.models import home_positions

    steps = []
    for joint, home in zip(model.actuated_joints, home_positions(model, {}), strict=True):
        above, below = joint.limits.upper - home, home - joint.limits.lower
        size = min(_STEP.get(joint.type, _ANGLE), max(above, below) / 4.0)
        steps.append(max(size, 1e-4) if above >= below else -max(size, 1e-4))
    return np.array(steps)


def _paths(simulation: Simulation, steps: np.ndarray) -> np.ndarray:
    """Return joint positions (runs, samples, dof) [rad or m]."""
    robot = simulation.robots["robot"]
    samples = round(SECONDS / simulation.physics_timestep) // _EVERY
    paths = np.empty((min(RUNS, robot.dof), samples, robot.dof))
    for run, path in enumerate(paths):
        simulation.reset()
        robot.command(robot.home + np.where(np.arange(robot.dof) % RUNS == run, steps, 0.0))
        for sample in range(samples):
            simulation.step(_EVERY)
            path[sample] = robot.joint_positions[0]
    return paths
