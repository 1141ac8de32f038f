"""The forearm has a mass and a visual shape, and no collision shape: it goes through everything."""

from __future__ import annotations

from by_outsider.robot.edited import edited

from templates.my_arm import MY_ARM

FAULTY = edited(
    MY_ARM,
    (
        """<xacro:rod radius="0.03" length="${fore}" mass="1" rgba="0.95 0.75 0.3 1" """
        """xyz="${fore / 2} 0 0" rpy="0 ${pi / 2} 0"/>""",
        """<inertial>
      <origin xyz="${fore / 2} 0 0"/>
      <mass value="1"/>
      <inertia ixx="0.00045" ixy="0" ixz="0" iyy="0.007725" iyz="0" izz="0.007725"/>
    </inertial>
    <visual>
      <origin xyz="${fore / 2} 0 0" rpy="0 ${pi / 2} 0"/>
      <geometry><cylinder radius="0.03" length="${fore}"/></geometry>
    </visual>""",
    ),
)
