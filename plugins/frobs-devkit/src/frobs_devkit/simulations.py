"""Builds a simulation of one robot, for checks, measurements and images."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager

from frobs_core.contracts import RobotHandle, Simulation
from frobs_core.description import Placement, Scene
from frobs_core.plugins.records import SimulatorRecord

TIMESTEP = 0.002
"""Duration of one physics step, unless another duration is chosen [s]."""


@contextmanager
def simulate(
    simulator: SimulatorRecord,
    placement: Placement,
    scene: Scene,
    *,
    num_envs: int = 1,
    physics_timestep: float = TIMESTEP,
    num_threads: int = 0,
) -> Iterator[tuple[Simulation, RobotHandle]]:
    """Build and reset a simulation of one robot, ``"robot"``, and close it at the end of the ``with`` block.

    The default number of threads, 0, is the simulator's default. The ``physics_timestep`` is in seconds.
    """
    made: Simulation = simulator.load()(
        scene.all_robots({"robot": placement}),
        scene,
        num_envs=num_envs,
        physics_timestep=physics_timestep,
        num_threads=num_threads,
    )
    with closing(made) as simulation:
        simulation.reset()
        yield simulation, simulation.robots["robot"]
