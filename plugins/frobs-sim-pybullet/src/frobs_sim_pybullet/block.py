"""A subset of the environments in one process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.interfaces import Placement, Scene
from frobs_sim_pybullet.editing import EditableWorld
from frobs_sim_pybullet.engine import Dynamics
from frobs_sim_pybullet.layout import Arrays, row
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.options import Engine


class Block:
    """A subset of the environments in this process.

    Args:
        robots: Robots, by name.
        scene: The rest of the scene.
        engine: Settings of the physics engine.
        arrays: Arrays of all environments.
        ids: Indices of the environments in this block.
    """

    def __init__(
        self, robots: Mapping[str, Placement], scene: Scene, engine: Engine, arrays: Arrays, ids: Sequence[int]
    ) -> None:
        self.ids = list(ids)
        self._dynamics = Dynamics()
        self.worlds: dict[int, EditableWorld] = {}
        meshes = MeshFiles()
        try:
            for i in self.ids:
                self.worlds[i] = EditableWorld(robots, scene, engine, self._dynamics, meshes, row(arrays, i))
        except BaseException:
            self.close()
            raise
        finally:
            meshes.clear()

    def step(self, decimation: int, rows: Mapping[str, Floats]) -> None:
        """Advance; rows are (environments in this block, decimation, dof) by robot."""
        for n, world in enumerate(self.worlds.values()):
            world.apply_sizes()
            world.step(decimation, {name: row[n] for name, row in rows.items()} if rows else {})

    def call(self, method: str, ids: Sequence[int], arguments: Sequence[Any]) -> list[Any]:
        """Call a method on some of the worlds.

        Args:
            method: Name of the method.
            ids: Indices of the environments.
            arguments: Arguments. Each world gets its row of arrays (n, …); other arguments are passed unchanged.

        Returns:
            The results, in the order of ``ids``.
        """
        results = []
        for n, i in enumerate(ids):
            if method != "write_parameter":  # so that several consecutive size changes rebuild the world only once
                self.worlds[i].apply_sizes()
            own = [argument[n] if isinstance(argument, np.ndarray) else argument for argument in arguments]
            results.append(getattr(self.worlds[i], method)(*own))
        return results

    def close(self) -> None:
        """Disconnect from Bullet. Calling it again has no effect."""
        if self._dynamics.client >= 0:
            for world in self.worlds.values():
                world.close()
            self._dynamics.close()
            self._dynamics.client = -1
