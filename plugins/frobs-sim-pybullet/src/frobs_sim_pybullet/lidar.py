"""Casts rays in one environment.

Bullet determines which objects the rays hit. The distances to round shapes are then computed exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from frobs_core.models import Geometry, Mesh, Pose
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_conjugate, quat_rotate
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.rays import ROUND, distances
from frobs_sim_pybullet.transforms import Quat, Vector, compose, from_pose

_LARGEST_BATCH = 16384 - 1  # maximum number of rays per Bullet call
_BEYOND = 0.02  # [m] after a false hit on a round shape, the ray continues this far behind the hit
_MOST_PASSES = 8

Collider: TypeAlias = tuple[tuple[tuple[Geometry, Pose], ...], Callable[[], tuple[Vector, Quat]]]
"""A link's shapes, and a function that returns the pose of the link's frame."""


class Rays:
    """Casts rays in one world."""

    def __init__(self, client: int, colliders: Mapping[tuple[int, int], Collider]) -> None:
        self._client = client
        self._round = {
            number: (shapes, pose)
            for number, (shapes, pose) in colliders.items()
            if any(isinstance(shape, ROUND) for shape, _ in shapes) and not any(isinstance(s, Mesh) for s, _ in shapes)
        }

    def cast(self, origins: Floats, directions: Floats, max_range: float, mask: int) -> Floats:
        """Return the distance at which each ray hits something, (k,) [m].

        Args:
            origins: Start points in the world frame, (k, 3) [m].
            directions: Unit vectors in the world frame, (k, 3).
            max_range: Length of the rays [m].
            mask: Bit mask of Bullet's collision groups that rays can hit.
        """
        result = np.full(len(origins), max_range)
        passed = np.zeros(len(origins))  # [m] distance at which the remaining part of each ray starts
        open_rays = np.arange(len(origins))
        for _ in range(_MOST_PASSES):
            if not len(open_rays):
                break
            starts = origins[open_rays] + passed[open_rays, None] * directions[open_rays]
            ends = origins[open_rays] + max_range * directions[open_rays]
            fractions, hits = self._batch(starts, ends, mask)
            length = max_range - passed[open_rays]
            result[open_rays] = passed[open_rays] + fractions * length
            open_rays = self._correct(open_rays, hits, origins, directions, result, passed, max_range)
        return result

    def _batch(self, starts: Floats, ends: Floats, mask: int) -> tuple[Floats, list[tuple[int, int]]]:
        fractions, hits = [], []
        first, last = starts.tolist(), ends.tolist()
        for at in range(0, len(first), _LARGEST_BATCH):
            part = slice(at, at + _LARGEST_BATCH)
            for hit in p.rayTestBatch(
                first[part], last[part], numThreads=1, collisionFilterMask=mask, physicsClientId=self._client
            ):
                fractions.append(hit[2] if hit[0] >= 0 else 1.0)
                hits.append((hit[0], hit[1]))
        return np.array(fractions), hits

    def _correct(
        self,
        rays: np.ndarray,
        hits: list[tuple[int, int]],
        origins: Floats,
        directions: Floats,
        result: Floats,
        passed: Floats,
        max_range: float,
    ) -> np.ndarray:
        """Set the exact distances to round shapes, and return the rays that miss these shapes and must be continued."""
        groups: dict[tuple[int, int], list[int]] = {}
        for ray, hit in zip(rays.tolist(), hits, strict=True):
            if hit in self._round:
                groups.setdefault(hit, []).append(ray)
        missed: list[int] = []
        for number, members in groups.items():
            shapes, pose = self._round[number]
            frame = pose()
            nearest = np.full(len(members), np.inf)
            for geometry, offset in shapes:
                (pos, (x, y, z, w)) = compose(frame, from_pose(offset))
                back = quat_conjugate([w, x, y, z])
                local = quat_rotate(back, origins[members] - pos)
                nearest = np.minimum(nearest, distances(geometry, local, quat_rotate(back, directions[members])))
            for ray, distance in zip(members, nearest.tolist(), strict=True):
                if distance < max_range:
                    result[ray] = distance
                elif result[ray] + _BEYOND < max_range:
                    passed[ray] = result[ray] + _BEYOND
                    missed.append(ray)
                else:
                    result[ray] = max_range
        return np.array(missed, np.intp)
