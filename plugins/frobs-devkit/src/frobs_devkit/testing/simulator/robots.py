"""Small robots for checks of simulators and controllers, with model files in the folder ``urdf``."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from frobs_core.description import ALL, DifferentialDrive, DriveGains, EndEffector, Robot
from frobs_core.models import RobotModel, load_model

ARM = Robot(
    model="kit_arm",
    name="kit_arm",
    tcp="tool",
    home={"shoulder": 0.3, "elbow": -0.4},
    gains=DriveGains(stiffness=400.0, damping=30.0),
    groups={ALL: ("shoulder", "elbow")},
    end_effectors={
        "tool": EndEffector(
            tcp="tool", group=ALL, open={"shoulder": 1.0, "elbow": 0.5}, closed={"shoulder": 0.0, "elbow": -1.0}
        )
    },
)
"""An arm with two revolute joints, whose axes and origins are rotated arbitrarily.

The arm has no shapes and thus no contacts. Gripper controllers can use the joints as two fingers.
"""

LIFT = Robot(
    model="kit_lift",
    name="kit_lift",
    tcp="table",
    gains=DriveGains(stiffness={"lift": 2000.0, "turn": 4.0}, damping={"lift": 150.0, "turn": 0.3}),
)
"""A table with a lifting joint and a turning joint.

The two joints are not coupled, so the drive law has a closed-form solution.
"""

LIFT_INERTIA = (3.0, 0.03)
"""Mass moved by the lifting joint of :data:`LIFT`, and moment of inertia moved by the turning joint [kg, kg·m²]."""

LIFT_WEIGHT = (3.0, 0.0)
"""Gravitational loads on the joints of :data:`LIFT`, divided by the gravitational acceleration [kg, kg·m]."""

LIFT_EFFORT_LIMIT = (200.0, 5.0)
"""Effort limits of the joints of :data:`LIFT` [N, N·m]."""

ROVER = Robot(
    model="kit_rover",
    name="kit_rover",
    tcp="hull",
    base="wheeled",
    gains=DriveGains(stiffness=0.0, damping=1.0),
    differential_drive=DifferentialDrive(
        left=("left",),
        right=("right",),
        separation=0.22,
        wheel_radius=0.05,
        max_linear_velocity=0.5,
        max_angular_velocity=2.0,
    ),
)
"""A rover with two driven wheels and two sliding feet."""

GRIPPER = Robot(model="kit_gripper", name="kit_gripper", tcp="tip")
"""A gripper with a finger and a follower.

The tip of the finger is a massless link. The follower's angle is −2 times the finger's angle plus 0.1 rad.
"""

PILE = Robot(model="kit_pile", name="kit_pile", tcp="c")
"""A chain of the balls a, b and c with a radius of 0.1 m, in which a and c overlap by :data:`PILE_DEPTH`."""

PILE_DEPTH = 0.05
"""Depth of the overlap between the balls a and c of :data:`PILE` [m]."""


@lru_cache
def model_of(name: str) -> RobotModel:
    """Read and return the model file of one of the kit's robots, by ``Robot.model``, such as ``"kit_arm"``."""
    return load_model(Path(__file__).with_name("urdf") / f"{name}.urdf")
