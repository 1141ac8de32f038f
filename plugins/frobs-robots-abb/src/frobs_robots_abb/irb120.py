"""Description of the ABB IRB 120 with the kinematics, masses and limits of the FRobs_RL model.

The gains make each joint critically damped at 10 Hz for the largest inertia I that the joint moves: Kp = I·ω² and Kd =
2·I·ω with ω = 62.8 rad/s, rounded. The largest inertias are 1.0 kg·m² for joints 1 and 2 (with the arm stretched) and
0.18, 0.005, 0.0025 and 0.001 kg·m² for joints 3 to 6. In all postures, the joints are critically damped or overdamped,
and gravity deflects them by at most about 10 mrad. A joint reaches the effort limit of 1,000 N·m only if its target
jumps by more than 0.25 rad.
"""

from __future__ import annotations

from frobs_core.description import Camera, DriveGains, Robot

IRB120 = Robot(
    model="frobs_robots_abb:models/irb120.urdf.xacro",
    name="irb120",
    # The elbow is bent, and the tool points down, 0.36 m in front of the base at a height of 0.43 m. No joint is near
    # a limit, and unlike the zero position, the posture is not singular.
    home={"joint_2": 0.2, "joint_3": 0.2, "joint_5": 1.17},
    tcp="tool0",
    gains=DriveGains(
        stiffness={
            "joint_1": 4000.0,
            "joint_2": 4000.0,
            "joint_3": 720.0,
            "joint_4": 20.0,
            "joint_5": 10.0,
            "joint_6": 4.0,
        },
        damping={
            "joint_1": 126.0,
            "joint_2": 126.0,
            "joint_3": 23.0,
            "joint_4": 0.65,
            "joint_5": 0.32,
            "joint_6": 0.13,
        },
    ),
    cameras={"wrist": Camera(pos=(0.08, 0.0, -0.02), target=(0.0, 0.0, 0.3), fov_y=60.0, frame="tool0")},
)
