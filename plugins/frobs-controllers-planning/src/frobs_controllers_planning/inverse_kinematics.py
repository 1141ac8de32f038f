"""Inverse kinematics by damped least squares from several initial joint positions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from frobs_controllers_planning.kinematics import Kinematics
from frobs_core.models import longest_reach
from frobs_core.util.arrays import Floats

POSITION_TOLERANCE = 1e-4
"""Default maximum distance from the goal position [m]."""
ROTATION_TOLERANCE = 1e-3
"""Default maximum angle from the goal orientation [rad]."""

_ITERATIONS = 60
_LARGEST_STEP = 0.5  # [rad or m] maximum motion of a joint per iteration
_DAMPING = 1e-3  # damping per unit of pose error: large far from the goal, and almost zero at the goal
_HOPELESS = 12  # give up if this many initial positions fail; for a reachable goal, usually at most half of them fail
_STALLED = 10  # give up after this many iterations without reducing the distance by a tenth


class InverseKinematics:
    """Solver for joint positions within an arm's limits that reach a tool pose.

    Args:
        kinematics: Kinematics of the robot.
        tcp: Name of the tool link.
        lower: Lower position limits, (dof,) [rad or m], finite.
        upper: Upper position limits, (dof,) [rad or m], finite.
    """

    def __init__(self, kinematics: Kinematics, tcp: str, lower: Floats, upper: Floats) -> None:
        self._kinematics, self._tcp = kinematics, tcp
        self._lower, self._upper = lower, upper
        self._reach = longest_reach(kinematics.robot, tcp)

    def solutions(
        self,
        pos: Floats,
        rotation: Floats | None,
        start: Floats,
        rng: np.random.Generator,
        tries: int,
        tolerances: tuple[float, float] = (POSITION_TOLERANCE, ROTATION_TOLERANCE),
    ) -> Iterator[Floats]:
        """Yield joint positions (dof,) [rad or m] that reach a goal, found from ``start`` and from random positions.

        The search ends early if it fails from each of the first 12 initial positions.

        Args:
            pos: Position of the tool in the root link's frame, (3,) [m].
            rotation: Rotation matrix of the tool in the root link's frame, (3, 3), or None for any orientation.
            start: First initial position of the joints, (dof,) [rad or m].
            rng: Generator of the random initial positions.
            tries: Maximum number of initial positions.
            tolerances: Maximum distance [m] and angle [rad] from the goal.
        """
        if float(np.linalg.norm(pos)) > self._reach + tolerances[0]:
            return
        found_any = False
        for attempt in range(tries):
            if attempt == _HOPELESS and not found_any:
                return
            guess = start if attempt == 0 else rng.uniform(self._lower, self._upper)
            solution = self._solve(pos, rotation, np.clip(guess, self._lower, self._upper), tolerances)
            if solution is not None:
                found_any = True
                yield solution

    def _solve(
        self, pos: Floats, rotation: Floats | None, joint_positions: Floats, tolerances: tuple[float, float]
    ) -> Floats | None:
        """Return a solution near the initial position, or None if the iteration does not converge."""
        best, stalled = np.inf, 0
        rows = 3 if rotation is None else 6
        for _ in range(_ITERATIONS):
            pose, jacobian = self._kinematics.frame_jacobian(self._tcp, joint_positions)
            error = pos - pose.translation
            distance = float(np.linalg.norm(error))
            reached = distance < tolerances[0]
            if rotation is not None:
                turn = pin.log3(rotation @ pose.rotation.T)
                angle = float(np.linalg.norm(turn))
                reached = reached and angle < tolerances[1]
                error, distance = np.concatenate([error, turn]), distance + angle
            if reached:
                return joint_positions
            stalled = 0 if distance < 0.9 * best else stalled + 1
            best = min(best, distance)
            if stalled > _STALLED:
                return None
            joint_positions = self._step(jacobian[:rows], error, joint_positions)
        return None

    def _step(self, jacobian: Floats, error: Floats, joint_positions: Floats) -> Floats:
        """Return joint positions closer to the goal. If limits stop some joints, the other joints compensate."""
        damping = (_DAMPING * float(np.linalg.norm(error)) + 1e-8) * np.eye(len(error))
        free = np.ones(len(joint_positions), bool)
        for _ in range(2):
            used = jacobian * free
            step = used.T @ np.linalg.solve(used @ used.T + damping, error)
            stopped = ((joint_positions <= self._lower) & (step < 0)) | ((joint_positions >= self._upper) & (step > 0))
            if not (stopped & free).any():
                break
            free &= ~stopped
            step = step * free
        step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        return np.clip(joint_positions + step, self._lower, self._upper)
