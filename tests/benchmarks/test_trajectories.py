from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ompl")
pytest.importorskip("toppra")
pytest.importorskip("pinocchio", exc_type=ImportError)  # which needs libgomp1

sys.path.insert(0, str(Path(__file__).parent))

import trajectories

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import load_model
from frobs_sim_mujoco.simulation import MujocoSimulation


@pytest.mark.parametrize("target", ["joint", "tcp"])
def test_goals_among_boxes_are_reached_within_the_limits_and_without_a_touch(target: str) -> None:
    found = trajectories.measure(target, goals=15, seed=7)
    assert found["reached"] == 15
    assert found["collisions"] == 0
    assert found["velocity_share"] <= 1.0
    assert found["acceleration_share"] <= 1.0
    assert found["joint_error"] < 0.02
    assert found["straight"] < 15, "nothing was in the way"


def test_the_page_says_what_was_measured() -> None:
    found = trajectories.measure("joint", goals=1)
    known = {
        **found,
        "goals": 500,
        "reached": 499,
        "plan_times": [0.01, 0.02, 0.06],
        "processor_times": [0.01],
        "velocity_share": 0.995,
    }
    known |= {"reasons": {"no_way_found": 1}, "durations": np.ones(499), "straight": 300}
    page = trajectories.report([known])
    assert '| | `target="joint"` |' in page
    assert "| reached | 499 (99.8%) |" in page
    assert "| no plan | 1 × no_way_found |" in page
    assert "| ways that are not one straight line | 199 |" in page
    assert "| planning, median | 20 ms |" in page
    assert "| largest velocity of the command, of the limit | 99.50% |" in page


def test_the_judge_sees_what_touches() -> None:
    described = RobotConfig(robot=trajectories.ROBOT).describe()
    placement = Placement(robot=described, model=load_model(described.model), command_mode=CommandMode.POSITION)
    simulation = MujocoSimulation({"robot": placement}, trajectories.scene(), num_envs=1, physics_timestep=0.002)

    def touched(*joint_positions: float) -> set[str]:
        simulation.reset()
        simulation.robots["robot"].write_joint_state(np.array([joint_positions]))
        simulation.robots["robot"].command(np.array([joint_positions]))
        simulation.step(1)
        return {name for name in trajectories.scene().contacts if simulation.contact(name)[0]}

    assert touched(0.0, 0.2, 0.2, 0.0, 1.17, 0.0) == set()
    assert touched(0.0, 1.9, 0.2, 0.0, 0.0, 0.0) == {"floor"}
    assert "post_0" in touched(0.67, 0.7, 0.2, 0.0, 0.5, 0.0)
    assert touched(0.19, 1.2, 1.21, -0.83, -1.38, -1.51) == {"robot"}
    simulation.close()
