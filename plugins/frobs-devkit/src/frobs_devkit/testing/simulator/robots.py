"""Small robots for checks of simulators and controllers; their models are in the folder ``urdf``."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from frobs_core.interfaces import ALL, DifferentialDrive, DriveGains, EndEffector, Robot
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
"""Two revolute joints with arbitrarily rotated axes and origins, without shapes, so it cannot touch anything.

Gripper controllers can use them as two fingers.
"""

LIFT = Robot(
    model="kit_lift",
    name="kit_lift",
    tcp="table",
    gains=DriveGains(stiffness={"lift": 2000.0, "turn": 4.0}, damping={"lift": 150.0, "turn": 0.3}),
)
"""A table that is lifted and rotated. Its two joints are not coupled, so the drive law has a closed form."""

LIFT_INERTIA = (3.0, 0.03)
"""Inertia at the joints of :data:`LIFT` [kg, kg·m²]."""

LIFT_WEIGHT = (3.0, 0.0)
"""Weight at the joints of :data:`LIFT`, per gravitational acceleration [kg, kg·m²]."""

LIFT_EFFORT_LIMIT = (200.0, 5.0)
"""Effort limits of :data:`LIFT` [N, N·m]."""

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
"""Two driven wheels and two sliding feet."""

GRIPPER = Robot(model="kit_gripper", name="kit_gripper", tcp="tip")
"""A finger whose tip is only a frame, and one that mimics it: −2 times its angle plus 0.1 rad."""

PILE = Robot(model="kit_pile", name="kit_pile", tcp="c")
"""Three balls of 0.1 m: two pairs of neighbors; a and c overlap by :data:`PILE_DEPTH`."""

PILE_DEPTH = 0.05
"""[m]"""


@lru_cache
def model_of(name: str) -> RobotModel:
    """Return the model of one of the kit's robots, read from its file.

    Args:
        name: ``Robot.model`` of the robot.
    """
    return load_model(Path(__file__).with_name("urdf") / f"{name}.urdf")
