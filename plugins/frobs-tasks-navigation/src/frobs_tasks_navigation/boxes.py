"""Boxes of a floor plan, which may have random orientations and may move back and forth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.contracts import Simulation, Snapshot, Stateful
from frobs_core.description import Body
from frobs_core.models import Box, Pose
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.random import RandomSource
from frobs_tasks_navigation import terms
from frobs_tasks_navigation.floor_plan import MovingBox

_RGBA = (0.90, 0.45, 0.16, 1.0)


def box_bodies(boxes: Sequence[MovingBox]) -> dict[str, Body]:
    """Return the scene's bodies for the boxes, by name."""
    return {
        f"box_{i}": Body(geometry=Box(box.size), pose=_pose(box), kinematic=_is_placed(box), rgba=_RGBA)
        for i, box in enumerate(boxes)
    }


def _is_placed(box: MovingBox) -> bool:
    """Return whether the box moves or has a random orientation, and must therefore be placed in each episode."""
    return box.yaw is None or box.max_speed > 0.0


def _pose(box: MovingBox) -> Pose:
    w, x, y, z = terms.quat_of(np.radians(box.yaw or 0.0)).tolist()
    return Pose((*box.pos, 0.5 * box.size[2]), (w, x, y, z))


class MovingBoxes(Stateful):
    """Poses of the boxes in all environments.

    A box moves back and forth along its own x axis. The box's position is computed directly from the heading, the speed
    and the time, so no integration errors accumulate.

    Args:
        boxes: Boxes of the floor plan.
        simulation: Simulation that contains the boxes as bodies.

    Attributes:
        half: Half edge lengths along x and y, (k, 2) [m].
    """

    def __init__(self, boxes: Sequence[MovingBox], simulation: Simulation) -> None:
        n, k = simulation.num_envs, len(boxes)
        self._simulation = simulation
        self._count = k
        self._centre = np.array([[*box.pos, 0.5 * box.size[2]] for box in boxes]).reshape(k, 3)
        self.half: Floats = np.array([box.size[:2] for box in boxes]).reshape(k, 2) / 2
        self._fixed_yaw = np.radians([np.nan if box.yaw is None else box.yaw for box in boxes])
        self._max_speed = np.array([box.max_speed for box in boxes])
        self._turn_every = np.array([box.turn_every for box in boxes])
        self._first_turn = np.array([box.first_turn or box.turn_every for box in boxes])
        self._placed = [i for i, box in enumerate(boxes) if _is_placed(box)]
        self._moving = [i for i, box in enumerate(boxes) if box.max_speed > 0.0]
        self._all_move = len(self._moving) == k
        self._placed_names, self._moving_names = (
            tuple(f"box_{i}" for i in numbers) for numbers in (self._placed, self._moving)
        )
        self._yaw: Floats = np.tile(self._fixed_yaw, (n, 1))
        self._velocity: Floats = np.zeros((n, k, 3))  # [m/s] before the first reversal

    def begin(self, mask: Mask | None, rng: RandomSource) -> None:
        """Draw the orientations and speeds of the boxes, and move the boxes to their initial positions.

        Args:
            mask: The n environments in which an episode begins.
            rng: Random source, of which the streams ``"box_yaw"`` and ``"box_speed"`` are used.
        """
        if not self._placed:
            return
        rows = rows_of(mask)
        shape = (self._count,)
        yaw = rng.uniform("box_yaw", -np.pi, np.pi, shape, mask)
        self._yaw[rows] = yaw = np.where(np.isnan(self._fixed_yaw), yaw, self._fixed_yaw)
        speed = rng.uniform("box_speed", 0.0, self._max_speed, shape, mask)
        self._velocity[rows] = np.stack([np.cos(yaw) * speed, np.sin(yaw) * speed, np.zeros_like(yaw)], axis=-1)
        pos = np.broadcast_to(self._centre[self._placed], (len(yaw), len(self._placed), 3))
        self._simulation.write_body_poses(self._placed_names, pos, terms.quat_of(yaw[:, self._placed]), mask)

    def move(self) -> None:
        """Move the boxes to their current positions."""
        if self._moving:
            pos = self.pos
            self._simulation.write_body_poses(self._moving_names, pos if self._all_move else pos[:, self._moving])

    @property
    def pos(self) -> Floats:
        """Current positions of the boxes' centers, (num_envs, k, 3) [m]."""
        time = terms.to_and_fro(self._simulation.time[:, None], self._first_turn, self._turn_every)
        return self._centre + time[..., None] * self._velocity

    @property
    def yaw(self) -> Floats:
        """Yaw angles of the boxes, (num_envs, k) [rad]."""
        return self._yaw

    def stored_arrays(self) -> Snapshot:
        """Return the boxes' orientations and velocities in the current episodes."""
        return {"box_yaw": self._yaw, "box_velocity": self._velocity}
