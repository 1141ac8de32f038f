"""The simulator to check, with which each check builds its own small simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeAlias

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.capabilities import Level
from frobs_core.interfaces import Body, CommandMode, Placement, Robot, RobotHandle, Scene, Simulation
from frobs_core.models import Box, Pose, Sphere
from frobs_core.specs import SimulatorRecord
from frobs_devkit.testing.checks import NotApplicable
from frobs_devkit.testing.compare import expect_close, expect_same
from frobs_devkit.testing.simulator.robots import ARM, model_of

TIMESTEP = 0.002
"""Duration of one physics step [s]."""

TILTED = Pose(pos=(0.2, -0.1, 0.4), quat_wxyz=(0.8, 0.36, -0.16, 0.4525483399593904))
"""Pose of a robot in which any wrong order of quaternion components becomes visible."""

BALL = Body(geometry=Sphere(0.05), pose=Pose(pos=(0.0, 2.0, 1.0)), mass=0.5)
"""A free ball, far above the floor."""

BAR = Body(geometry=Box((1.0, 0.1, 0.1)), pose=Pose(pos=(0.0, -3.0, 1.0)), kinematic=True)
"""A kinematic bar along its x axis."""

WALL = Body(geometry=Box((0.2, 4.0, 4.0)), pose=Pose(pos=(2.0, 0.0, 1.0)))
"""Its near face is the plane x = 1.9 m."""


@dataclass(frozen=True)
class SimulatorUnderTest:
    """A simulator, by its record."""

    record: SimulatorRecord

    def level(self, capability: str) -> Level:
        """Level at which it claims a capability."""
        return self.record.capabilities.get(capability, Level.UNSUPPORTED)

    def tolerance(self, capability: str, exact: float = 1e-9, approximate: float = 0.02) -> float:
        """Return the tolerance of a number, according to the simulator's claim."""
        return exact if self.level(capability) == Level.EXACT else approximate

    @property
    def at_home(self) -> float:
        """Tolerance of a joint at home after a reset [rad or m, rad/s or m/s]; a paced simulator drives there."""
        return 0.05 if self.record.is_paced else 1e-12

    @property
    def num_envs(self) -> int:
        """3, or 1 if the simulator only supports one environment."""
        return 3 if self.level("batched") else 1

    @contextmanager
    def build(
        self,
        robot: Robot = ARM,
        *,
        num_envs: int | None = None,
        mode: CommandMode = CommandMode.POSITION,
        pose: Pose | None = None,
        bodies: Mapping[str, Body] | None = None,
        num_threads: int = 0,
        **scene: Any,
    ) -> Iterator[tuple[Simulation, RobotHandle]]:
        """Build and reset a simulation of one robot. It is closed at the end of the ``with`` block."""
        placement = Placement(robot=robot, model=model_of(robot.model), pose=pose or Pose(), command_mode=mode)
        whole = Scene(bodies=bodies or {}, **scene)
        made: Simulation = self.record.load()(
            whole.all_robots({"robot": placement}),
            whole,
            num_envs=self.num_envs if num_envs is None else num_envs,
            physics_timestep=TIMESTEP,
            num_threads=num_threads,
        )
        with closing(made) as simulation:
            simulation.reset()
            yield simulation, simulation.robots["robot"]


SimulatorCheck: TypeAlias = Callable[[SimulatorUnderTest], None]


def verifies(capability: str) -> Callable[[SimulatorCheck], SimulatorCheck]:
    """Mark a check as verifying a capability. It does not apply to simulators that do not claim it."""

    def decorate(function: SimulatorCheck) -> SimulatorCheck:
        @wraps(function)
        def check(subject: SimulatorUnderTest) -> None:
            if subject.level(capability) == Level.UNSUPPORTED:
                raise NotApplicable(f"the simulator does not claim '{capability}'")
            function(subject)

        check.capability = capability  # type: ignore[attr-defined]
        return check

    return decorate


def spread(low: float, high: float, shape: tuple[int, ...], seed: int = 0) -> Floats:
    """Draw numbers that differ between environments but are the same in each run."""
    return np.random.default_rng(seed).uniform(low, high, shape)


def state_of(sim: Simulation, robot: RobotHandle) -> dict[str, Floats]:
    """Return the readable state of the joints, the tool and the bodies, as copies."""
    state: dict[str, Any] = {
        "positions": robot.joint_positions,
        "velocities": robot.joint_velocities,
        "time": sim.time,
        "tcp": robot.frame_pose("tcp")[0],
    }
    for name, body in sim.bodies.items():
        state[f"{name}_pos"], state[f"{name}_quat"] = body.pose
        state[f"{name}_lin_vel"], state[f"{name}_ang_vel"] = body.twist
    return {name: np.array(array) for name, array in state.items()}


def move(
    sim: Simulation, robot: RobotHandle, steps: int, seed: int = 0, rows: int | None = None, row: int | None = None
) -> dict[str, Floats]:
    """Command random positions. Pass ``row`` and ``rows`` if a single environment represents one of a batch."""
    for k in range(steps):
        drawn = spread(-0.6, 0.6, (rows or sim.num_envs, 2), seed=seed + k)
        robot.command(robot.home + (drawn if row is None else drawn[[row]]))
        sim.step(10)
    return state_of(sim, robot)


def expect_state(subject: SimulatorUnderTest, expected: dict[str, Floats], found: dict[str, Floats], what: str) -> None:
    """Raise CheckFailure unless two states are equal; bit-identical if the simulator claims exact determinism."""
    for name, array in expected.items():
        if subject.level("determinism") == Level.EXACT:
            expect_same(array, found[name], f"{what}: {name}")
        else:
            expect_close(array, found[name], 0.02, f"{what}: {name}")
