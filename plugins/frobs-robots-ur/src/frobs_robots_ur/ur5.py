"""Description of the Universal Robots UR5 with the kinematics, masses and limits of the FRobs_RL model.

The drive gains are computed by :func:`frobs_core.models.defaults.default_gains`. Because the drives are weak for their
load (150 N·m for up to 3.6 kg·m²), the gains of the first two joints correspond to 4 Hz instead of 10 Hz, and gravity
deflects these joints by up to 25 mrad.
"""

from __future__ import annotations

from frobs_core.description import Camera, Robot

UR5 = Robot(
    model="frobs_robots_ur:models/ur5.urdf.xacro",
    name="ur5",
    # In the zero position, the arm extends along the floor. In the home position, the elbow is up, and the tool points
    # down, 0.41 m in front of the base at a height of 0.37 m. The home position is not singular, and only the elbow
    # is near a limit.
    home={
        "shoulder_lift_joint": -1.75,
        "elbow_joint": 1.9,
        "wrist_1_joint": -1.72,
        "wrist_2_joint": -1.57,
    },
    tcp="tool0",
    cameras={"wrist": Camera(pos=(0.08, 0.0, -0.02), target=(0.0, 0.0, 0.3), fov_y=60.0, frame="tool0")},
)
