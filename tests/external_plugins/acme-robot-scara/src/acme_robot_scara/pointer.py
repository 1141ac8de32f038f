"""An end effector, and the arm with it."""

from acme_robot_scara.scara import SCARA
from frobs_core.interfaces import EndEffector, Robot

POINTER = Robot(
    model="acme_robot_scara:models/pointer.urdf",
    name="pointer",
    end_effectors={"pointer": EndEffector(tcp="point")},
)
"""A stick of 4 cm."""

SCARA_WITH_POINTER = SCARA.attach("tip", POINTER, name="pointer")
