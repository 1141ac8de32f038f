"""Description of a suction cup with a force-torque sensor. The suction cup cannot hold objects yet."""

from __future__ import annotations

from frobs_core.description import Camera, EndEffector, ForceTorque, Robot

SUCTION_CUP = Robot(
    model="frobs_grippers:models/suction_cup.urdf.xacro",
    name="suction_cup",
    tcp="tcp",
    sensors={"wrench": ForceTorque(frame="cup")},
    end_effectors={"cup": EndEffector(tcp="tcp")},
    cameras={"wrist": Camera(pos=(0.07, 0.0, -0.05), target=(0.035, 0.0, 0.05), fov_y=85.0, frame="tcp")},
)
