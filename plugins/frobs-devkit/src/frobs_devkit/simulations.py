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
    """Build and reset a simulation of one robot, and close the simulation at the end of the ``with`` block.

    Args:
        simulator: Record of the simulator.
        placement: Placement of the robot, whose name in the simulation is ``"robot"``.
        scene: The scene, with its props.
        num_envs: Number of environments.
        physics_timestep: Duration of one physics step [s].
        num_threads: Number of threads, or 0 for the simulator's default.
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
