"""Arms that nobody chose gains for: each joint steps, and goes where it shall without swinging or locking."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pybullet_data")

from corpus import files
from engines import build

from frobs_core import plugins
from frobs_core.models import JointType, load_model

FILES = files()
if not any(name.startswith("example-robot-data") for name in FILES):
    pytest.skip("example-robot-data is not installed", allow_module_level=True)

ARMS = {
    "panda": "example-robot-data/panda_description/urdf/panda.urdf",
    "panda of pybullet": "pybullet_data/franka_panda/panda.urdf",
    "ur3": "example-robot-data/ur_description/urdf/ur3_robot.urdf",
    "ur5": "example-robot-data/ur_description/urdf/ur5_robot.urdf",
    "ur10": "example-robot-data/ur_description/urdf/ur10_robot.urdf",
    "xarm6": "pybullet_data/xarm/xarm6_robot.urdf",
    "xarm7": "example-robot-data/xarm_description/urdf/xarm7.urdf",
    "iiwa": "pybullet_data/kuka_iiwa/model.urdf",
    "so100": "example-robot-data/so_arm_description/urdf/so100.urdf",
    "so101": "example-robot-data/so_arm_description/urdf/so101.urdf",
    "z1": "example-robot-data/z1_description/urdf/z1.urdf",
}
BENT = {"iiwa": {"lbr_iiwa_joint_2": 0.6, "lbr_iiwa_joint_4": -1.2, "lbr_iiwa_joint_6": 0.9}}
FAST = ("ur10",)
STEP, SECONDS = 0.2, 2.0  # [rad], [s]


@pytest.mark.parametrize("simulator", sorted({*plugins.engines()} - {"gazebo"}))
@pytest.mark.parametrize("arm", [a if a in FAST else pytest.param(a, marks=pytest.mark.slow) for a in ARMS])
def test_every_joint_of_an_unknown_arm_steps_without_swinging(arm, simulator):
    model = load_model(FILES[ARMS[arm]])
    dof = len(model.joint_names)
    simulation = build(simulator, model, dof, home=BENT.get(arm, {}), self_collision=False)
    robot = simulation.robots["robot"]
    sizes = np.array([0.01 if j.type is JointType.PRISMATIC else STEP for j in model.actuated_joints])
    row = np.arange(dof)  # environment i steps joint i
    target = robot.home.copy()
    upward = target[row, row] + sizes <= robot.position_upper[row, row]
    sizes = np.where(upward, sizes, -sizes)

    robot.command(target)
    simulation.step(1000)
    start = robot.joint_positions.copy()
    target[row, row] += sizes
    robot.command(target)
    path = []
    for _ in range(round(SECONDS / 0.01)):
        simulation.step(5)
        path.append(robot.joint_positions[row, row])
    share = (np.array(path) - start[row, row]) / sizes
    efforts, limit = np.abs(robot.joint_efforts[row, row]), robot.effort_limit[row, row]
    simulation.close()

    assert share.max(axis=0) == pytest.approx(share[-1], abs=0.05)  # no overshoot
    assert share[-1] == pytest.approx(np.ones(dof), abs=0.25)  # gravity and friction hold a little back
    assert (efforts < limit).all()  # no drive is left at its limit
    assert np.abs(start - robot.home).max() < 0.1
