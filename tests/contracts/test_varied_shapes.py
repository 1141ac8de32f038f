"""Shapes from a fixed set: a body for each shape, of which every environment uses one, on two engines."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import Control, Simulation
from frobs_core.description import Body, Scene
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.models import Box, Cylinder, Pose
from frobs_core.plugins import get_record
from frobs_core.util.arrays import Mask
from frobs_core.util.random import RandomSource
from frobs_tasks_reach.reach import Reach

SHAPES = {"box": Box((0.08, 0.08, 0.1)), "cylinder": Cylinder(0.04, 0.1)}
PLACE = (0.35, 0.25, 0.05)  # [m]


class ReachBesideObject(Reach):
    def scene(self) -> Scene:
        bodies = {
            name: Body(geometry=shape, mass=0.2, pose=Pose((3.0, 0.5 * i, 0.05)))
            for i, (name, shape) in enumerate(SHAPES.items())
        }
        return replace(super().scene(), bodies=bodies)

    def bind(self, simulation: Simulation, control: Control, control_timestep: float) -> None:
        super().bind(simulation, control, control_timestep)
        self.bodies = simulation.bodies

    def reset(self, mask: Mask | None, rng: RandomSource, options: Mapping[str, Any]) -> None:
        super().reset(mask, rng, options)
        chosen = rng.integers("shape", 0, len(SHAPES), mask=mask)
        begun = np.ones(len(chosen), bool) if mask is None else mask.copy()
        for i, name in enumerate(SHAPES):
            using = begun.copy()
            using[begun] = chosen == i
            self.bodies[name].write_pose(np.array([PLACE]), mask=using)


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_each_environment_shows_a_shape_of_its_own(simulator: str) -> None:
    task = replace(get_record("task", "reach"), entry_point=f"{__name__}:ReachBesideObject")
    env = RobotVectorEnv(
        num_envs=4, task=task, robot="irb120", controller="joint_delta_position", simulator=simulator, num_threads=1
    )
    with closing(env):
        seen = set()
        for seed in range(3):
            env.reset(seed=seed)
            for _ in range(5):
                env.step(np.zeros((4, 6), np.float32))
            places = {name: env.simulation.bodies[name].pose[0].copy() for name in SHAPES}
            in_use = {name: pos[:, 0] < 1.0 for name, pos in places.items()}
            assert (in_use["box"] != in_use["cylinder"]).all()
            for i, (name, pos) in enumerate(places.items()):
                expected = np.where(in_use[name][:, None], PLACE, (3.0, 0.5 * i, 0.05))
                assert pos == pytest.approx(expected, abs=2e-3)
            seen.add(tuple(in_use["box"].tolist()))
        assert len(seen) > 1
        assert any(len(set(shown)) == 2 for shown in seen)
