"""The simulator to check, from which each check builds a small simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any, TypeAlias

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.description import Body, Placement, Robot, Scene
from frobs_core.models import Box, Pose, RobotModel, Sphere
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, RenderingUnavailableError, SceneError
from frobs_devkit.simulations import TIMESTEP as TIMESTEP
from frobs_devkit.simulations import simulate
from frobs_devkit.testing.checks import Inconclusive, NotApplicable
from frobs_devkit.testing.compare import expect_close, expect_same
from frobs_devkit.testing.simulator.robots import ARM, model_of

WEIGHTLESS = (0.0, 0.0, 0.0)  # [m/s²]
TILTED = Pose(pos=(0.2, -0.1, 0.4), quat_wxyz=(0.8, 0.36, -0.16, 0.4525483399593904))
"""A pose whose quaternion reveals an incorrect component order."""

BALL = Body(geometry=Sphere(0.05), pose=Pose(pos=(0.0, 2.0, 1.0)), mass=0.5)
"""A free ball far above the floor."""

BAR = Body(geometry=Box((1.0, 0.1, 0.1)), pose=Pose(pos=(0.0, -3.0, 1.0)), kinematic=True)
"""A kinematic bar along its x axis."""

WALL = Body(geometry=Box((0.2, 4.0, 4.0)), pose=Pose(pos=(2.0, 0.0, 1.0)))
"""A wall whose near face is in the plane x = 1.9 m."""


@dataclass(frozen=True)
class SimulatorUnderTest:
    """The record of a simulator, with methods that build simulations for its checks."""

    record: SimulatorRecord

    def level(self, capability: str) -> Level:
        """Return the level at which the simulator claims a capability."""
        return self.record.capabilities.get(capability, Level.UNSUPPORTED)

    def tolerance(self, capability: str, exact: float = 1e-9, approximate: float = 0.02) -> float:
        """Return the numerical tolerance for the level at which the simulator claims a capability."""
        return exact if self.level(capability) == Level.EXACT else approximate

    def require_steps(self) -> None:
        """Raise NotApplicable if the simulator is paced, because its physics steps then differ between runs."""
        if self.record.is_paced:
            raise NotApplicable("the simulator is paced, so its physics steps differ between runs")

    @property
    def at_home(self) -> float:
        """Tolerance of joint positions [rad or m] and joint velocities [rad/s or m/s] at home after a reset.

        The tolerance is larger for a paced simulator, because its resets drive the joints home.
        """
        return 0.05 if self.record.is_paced else 1e-12

    @property
    def num_envs(self) -> int:
        """Number of environments for the checks: 3, or 1 if the simulator does not support batches."""
        return 3 if self.level("batched") else 1

    def expect_each(self, row: Any, actual: Any, tolerance: float, what: str) -> None:
        """Raise CheckFailure unless an array has a row for each environment, and each is ``row`` within a tolerance."""
        expect_close(np.broadcast_to(row, (self.num_envs, *np.shape(row))), actual, tolerance, what)

    @cached_property
    def free_bodies(self) -> Mapping[str, Body]:
        """A free ball for scenes in which anything may move, or nothing if the simulator rejects free bodies.

        No capability says whether a simulator has free bodies: it rejects them with a SceneError.
        """
        ball = {"ball": BALL}
        placement = Placement(robot=ARM, model=model_of(ARM.model), command_mode=CommandMode.POSITION)
        try:
            with simulate(self.record, placement, Scene(bodies=ball)):
                return ball
        except SceneError:
            return {}

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
        timestep: float = TIMESTEP,
        model: RobotModel | None = None,
        **scene: Any,
    ) -> Iterator[tuple[Simulation, RobotHandle]]:
        """Build and reset a simulation of one robot, and close the simulation at the end of the ``with`` block.

        Raises:
            NotApplicable: The simulator rejects a scene with free bodies, or a robot whose base moves.
        """
        placement = Placement(robot=robot, model=model or model_of(robot.model), pose=pose or Pose(), command_mode=mode)
        complete_scene = Scene(bodies=bodies or {}, **scene)
        options: dict[str, Any] = {"num_envs": num_envs or self.num_envs, "num_threads": num_threads}
        with ExitStack() as stack:
            try:
                built = stack.enter_context(
                    simulate(self.record, placement, complete_scene, physics_timestep=timestep, **options)
                )
            except ConfigurationError as error:
                free = any(body.is_free for body in complete_scene.bodies.values())
                if robot.base != "fixed" or (free and isinstance(error, SceneError) and not self.free_bodies):
                    raise NotApplicable(f"the simulator rejects what this check needs: {error}") from error
                raise
            yield built


SimulatorCheck: TypeAlias = Callable[[SimulatorUnderTest], None]


def verifies(capability: str, *needed: str) -> Callable[[SimulatorCheck], SimulatorCheck]:
    """Return a decorator for checks that apply only to simulators that claim a capability, and others that it needs.

    If the machine cannot render, the check is inconclusive.
    """

    def decorate(function: SimulatorCheck) -> SimulatorCheck:
        @wraps(function)
        def check(subject: SimulatorUnderTest) -> None:
            if subject.level(capability) == Level.UNSUPPORTED:
                raise NotApplicable(f"the simulator does not claim '{capability}'")
            for other in needed:
                if not subject.level(other):
                    raise NotApplicable(f"the simulator does not have the capability '{other}'")
            try:
                function(subject)
            except RenderingUnavailableError as error:
                raise Inconclusive(str(error)) from error

        check.capability = capability  # type: ignore[attr-defined]
        return check

    return decorate


def spread(low: float, high: float, shape: tuple[int, ...], seed: int = 0) -> Floats:
    """Draw uniformly distributed numbers that differ between rows but are the same in each run."""
    return np.random.default_rng(seed).uniform(low, high, shape)


def state_of(sim: Simulation, robot: RobotHandle) -> dict[str, Floats]:
    """Return copies of the joint states, the time, the tool position and the body states."""
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
    """Command random joint positions for several steps, and return the resulting state.

    Pass ``rows`` and ``row`` if the simulation's single environment represents one row of a batch.
    """
    for k in range(steps):
        drawn = spread(-0.6, 0.6, (rows or sim.num_envs, 2), seed=seed + k)
        robot.command(robot.home + (drawn if row is None else drawn[[row]]))
        sim.step(10)
    return state_of(sim, robot)


def expect_state(subject: SimulatorUnderTest, expected: dict[str, Floats], found: dict[str, Floats], what: str) -> None:
    """Raise CheckFailure unless two states are close, or bit-identical if the simulator claims exact determinism."""
    for name, array in expected.items():
        if subject.level("determinism") == Level.EXACT:
            expect_same(array, found[name], f"{what}: {name}")
        else:
            expect_close(array, found[name], 0.02, f"{what}: {name}")
