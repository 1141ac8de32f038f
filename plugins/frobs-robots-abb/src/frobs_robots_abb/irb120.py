"""The ABB IRB 120, with the kinematics, masses and limits of FRobs_RL's model.

The gains make each joint critically damped at 10 Hz for the largest inertia that it ever carries (joints 1 and 2: the
arm stretched out, 1.0 kg·m²; then 0.18, 0.005, 0.0025 and 0.001 kg·m²), rounded: Kp = I·ω² and Kd = 2·I·ω with
ω = 62.8 rad/s. Nowhere is a joint less than critically damped; gravity bends none by more than about 10 mrad; the
effort limit of 1,000 N·m is reached only when a target jumps by more than 0.25 rad.
"""

from __future__ import annotations

from frobs_core.interfaces import DriveGains, Robot

IRB120 = Robot(
    model="frobs_robots_abb:models/irb120.urdf.xacro",
    name="irb120",
    # elbow bent, tool 0.36 m in front of the base at a height of 0.43 m, pointing down: no joint is near a limit, and
    # the arm is not singular, as it is at zero
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
)
