"""Description of the ABB IRB 140 with the kinematics, masses and limits of the FRobs_RL model.

The gains make each joint critically damped for the largest inertia I that the joint moves: Kp = I·ω² and Kd = 2·I·ω,
rounded up. The frequency ω corresponds to 5 Hz for joints 1 and 2, and to 10 Hz for all other joints. With 10 Hz,
joints 1 and 2 would reach the effort limit of 1,000 N·m if a target jumped by 0.03 rad. The largest inertias are 8.2
and 5.6 kg·m² for joints 1 and 2 (with the arm stretched) and 0.64, 0.0085, 0.0022 and 0.001 kg·m² for joints 3 to 6. In
all postures, the joints are critically damped or overdamped. Gravity deflects joint 2 by up to 22 mrad, and the other
joints by up to 6 mrad.
"""

from __future__ import annotations

from frobs_core.description import Camera, DriveGains, Robot

IRB140 = Robot(
    model="frobs_robots_abb:models/irb140.urdf.xacro",
    name="irb140",
    # The elbow is bent, and the tool points down, 0.51 m in front of the base at a height of 0.53 m. The posture is far
    # from joint limits and singularities.
    home={"joint_2": 0.2, "joint_3": 0.1, "joint_5": 1.27},
    tcp="tool0",
    gains=DriveGains(
        stiffness={
            "joint_1": 8100.0,
            "joint_2": 5600.0,
            "joint_3": 2540.0,
            "joint_4": 34.0,
            "joint_5": 9.0,
            "joint_6": 4.0,
        },
        damping={
            "joint_1": 517.0,
            "joint_2": 355.0,
            "joint_3": 81.0,
            "joint_4": 1.1,
            "joint_5": 0.29,
            "joint_6": 0.13,
        },
    ),
    cameras={"wrist": Camera(pos=(0.1, 0.0, -0.02), target=(0.0, 0.0, 0.3), fov_y=60.0, frame="tool0")},
)
