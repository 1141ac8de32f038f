"""A block of environments that run in the same process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.description import Placement, Scene
from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.editing import EditableWorld
from frobs_sim_pybullet.engine import Dynamics
from frobs_sim_pybullet.layout import Arrays, row
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.options import Engine


class Block:
    """A block of environments that run in this process."""

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
        """Advance all environments in this block.

        Args:
            decimation: Number of physics steps.
            rows: Commands for each physics step, (environments in this block, decimation, dof), by robot. Robots may be
                omitted.
        """
        for n, world in enumerate(self.worlds.values()):
            world.apply_sizes()
            world.step(decimation, {name: row[n] for name, row in rows.items()} if rows else {})

    def call(self, method: str, ids: Sequence[int], arguments: Sequence[Any]) -> list[Any]:
        """Call a method on several of the worlds in this block.

        Args:
            method: Name of the method.
            ids: Indices of the environments.
            arguments: Arguments of the method. Each world receives its own row of each array (n, …). Other arguments
                are passed unchanged.

        Returns:
            The method's results, in the order of ``ids``.
        """
        results = []
        for n, i in enumerate(ids):
            if method != "write_parameter":  # consecutive size changes cause only one rebuild of the world
                self.worlds[i].apply_sizes()
            own = [argument[n] if isinstance(argument, np.ndarray) else argument for argument in arguments]
            results.append(getattr(self.worlds[i], method)(*own))
        return results

    def close(self) -> None:
        """Disconnect from Bullet. Repeated calls have no effect."""
        if self._dynamics.client >= 0:
            for world in self.worlds.values():
                world.close()
            self._dynamics.close()
            self._dynamics.client = -1
