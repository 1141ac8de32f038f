"""A motion that checks compare: drawn commands, and the state that they lead to."""

from __future__ import annotations

from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.capabilities import Level
from frobs_core.interfaces import RobotHandle, Simulation
from frobs_devkit.testing.compare import expect_close, expect_same
from frobs_devkit.testing.simulator.subject import SimulatorUnderTest, spread


def state_of(sim: Simulation, robot: RobotHandle) -> dict[str, Floats]:
    """Return what can be read of the joints, the tool and the bodies, as copies."""
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
    """Command drawn positions; ``row`` of ``rows`` where one environment stands for one of a batch."""
    for k in range(steps):
        drawn = spread(-0.6, 0.6, (rows or sim.num_envs, 2), seed=seed + k)
        robot.command(robot.home + (drawn if row is None else drawn[[row]]))
        sim.step(10)
    return state_of(sim, robot)


def expect_state(subject: SimulatorUnderTest, expected: dict[str, Floats], found: dict[str, Floats], what: str) -> None:
    """Raise CheckFailure unless two states are equal: bit for bit where the simulator claims exact determinism."""
    for name, array in expected.items():
        if subject.level("determinism") == Level.EXACT:
            expect_same(array, found[name], f"{what}: {name}")
        else:
            expect_close(array, found[name], 0.02, f"{what}: {name}")
