"""A 7-axis arm, a gripper with two fingers, and a task with a cube, made of the public API alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from frobs_core.contracts import Task
from frobs_core.description import Body, Contact, DriveGains, EndEffector, ObservationTerm, Robot, Scene
from frobs_core.models import Box, Pose
from frobs_core.plugins.records import TaskRecord

HERE = Path(__file__).parent
CUBE = 0.04  # [m]

ARM = Robot(
    model=str(HERE / "arm.urdf.xacro"),
    name="arm",
    home={
        "joint_2": -0.785,
        "joint_4": -2.356,
        "joint_6": 1.571,
        "joint_7": 0.785,
    },
    tcp="flange",
)
FINGERS = Robot(
    model=str(HERE / "fingers.urdf"),
    name="fingers",
    home={"left": 0.04, "right": 0.04},
    gains=DriveGains(stiffness=1000.0, damping=60.0),
    default_controllers={"all": "gripper_position"},
    end_effectors={
        "fingers": EndEffector(tcp="tcp", open={"left": 0.04, "right": 0.04}, closed={"left": 0.0, "right": 0.0})
    },
)


class CubeTask(Task):
    """A cube in front of the arm; every robot's tool position is observed, and nothing is rewarded."""

    def scene(self) -> Scene:
        cube = Body(geometry=Box((CUBE,) * 3), pose=Pose((0.5, 0.0, CUBE / 2)), mass=0.1)
        return Scene(bodies={"cube": cube}, contacts={"cube on floor": Contact(first="cube", second="floor")})

    def bind(self, simulation, control, control_timestep):
        self.simulation = simulation

    def reset(self, mask, rng, options):
        pass

    def observation_terms(self):
        far = np.full(3, np.inf)
        return {
            name: ObservationTerm(read=lambda robot=robot: robot.frame_pose("tcp")[0], low=-far, high=far, unit="m")
            for name, robot in self.simulation.robots.items()
        }

    def reward(self, context):
        return np.zeros(self.simulation.num_envs)

    def is_success(self):
        return np.zeros(self.simulation.num_envs, bool)


class CubeRecord(TaskRecord):
    """A record whose implementation needs no import."""

    def load(self):
        return CubeTask


CUBE_TASK = CubeRecord(name="cube", summary="", entry_point="nowhere:CubeTask")


def go_to(env, target, opening, steps):
    """Move the tool to a point with the gripper at an opening; return the last tool position (3,) [m]."""
    robot = env.robot
    for _ in range(steps):
        pos = robot.frame_pose("tcp")[0][0]
        env.step(np.concatenate([np.clip(0.2 * (target - pos) / 0.02, -1.0, 1.0), np.zeros(3), [opening]]))
    return robot.frame_pose("tcp")[0][0].copy()
