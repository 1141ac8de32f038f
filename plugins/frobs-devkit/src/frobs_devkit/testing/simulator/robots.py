"""The small robots that simulators and controllers are checked with, as text."""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path

from frobs_core.interfaces import DifferentialDrive, DriveGains, Robot
from frobs_core.models import RobotModel, load_model


def _inertial(mass: float, inertia: tuple[float, float, float], pos: str = "0 0 0") -> str:
    ixx, iyy, izz = inertia
    return (
        f'<inertial><origin xyz="{pos}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/></inertial>'
    )


def _joint(name: str, kind: str, parent: str, child: str, origin: str, axis: str, limit: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin {origin}/><axis xyz="{axis}"/><limit {limit}/></joint>'
    )


_ARM = f"""<robot name="kit_arm">
<link name="base">{_inertial(4.0, (0.02, 0.02, 0.02))}</link>
<link name="upper">{_inertial(1.0, (0.01, 0.012, 0.005), "0 0 0.1")}</link>
<link name="fore">{_inertial(0.6, (0.004, 0.005, 0.002), "0.1 0 0")}</link>
<link name="tool">{_inertial(0.1, (0.0002, 0.0002, 0.0002))}</link>
{
    _joint(
        "shoulder",
        "revolute",
        "base",
        "upper",
        'xyz="0.05 0 0.3" rpy="0.3 0.1 -0.2"',
        "0 0 1",
        'lower="-2.5" upper="2.5" velocity="4" effort="80"',
    )
}
{
    _joint(
        "elbow",
        "revolute",
        "upper",
        "fore",
        'xyz="0 0.02 0.25" rpy="0 0.4 0"',
        "0 0.6 0.8",
        'lower="-2.2" upper="2.2" velocity="3" effort="60"',
    )
}
<joint name="mount" type="fixed"><parent link="fore"/><child link="tool"/><origin xyz="0.25 0.01 0" rpy="0 1.2 0"/></joint>
</robot>"""

_LIFT = f"""<robot name="kit_lift">
<link name="base">{_inertial(4.0, (0.02, 0.02, 0.02))}</link>
<link name="carriage">{_inertial(2.0, (0.02, 0.02, 0.02))}</link>
<link name="table">{_inertial(1.0, (0.02, 0.02, 0.03))}</link>
{
    _joint(
        "lift",
        "prismatic",
        "base",
        "carriage",
        'xyz="0 0 3"',
        "0 0 1",
        'lower="-2" upper="2" velocity="9" effort="200"',
    )
}
{
    _joint(
        "turn",
        "revolute",
        "carriage",
        "table",
        'xyz="0 0 0.1"',
        "0 0 1",
        'lower="-30" upper="30" velocity="90" effort="5"',
    )
}
</robot>"""

_WHEEL = (
    '<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision>'
)
_ROVER = f"""<robot name="kit_rover">
<link name="hull">{_inertial(3.0, (0.02, 0.02, 0.03))}
<collision><origin xyz="0 0 0.03"/><geometry><box size="0.3 0.16 0.06"/></geometry></collision>
<collision><origin xyz="0.12 0 -0.03"/><geometry><sphere radius="0.019"/></geometry></collision>
<collision><origin xyz="-0.12 0 -0.03"/><geometry><sphere radius="0.019"/></geometry></collision></link>
<link name="left_wheel">{_inertial(0.2, (0.0005, 0.0005, 0.0005))}{_WHEEL}</link>
<link name="right_wheel">{_inertial(0.2, (0.0005, 0.0005, 0.0005))}{_WHEEL}</link>
{_joint("left", "continuous", "hull", "left_wheel", 'xyz="0 0.11 0"', "0 1 0", 'velocity="40" effort="20"')}
{_joint("right", "continuous", "hull", "right_wheel", 'xyz="0 -0.11 0"', "0 1 0", 'velocity="40" effort="20"')}
</robot>"""

_GRIPPER = f"""<robot name="kit_gripper">
<link name="palm">{_inertial(1.0, (0.01, 0.01, 0.01))}</link>
<link name="finger">{_inertial(0.3, (0.002, 0.002, 0.002), "0 0 0.05")}</link>
<link name="follower">{_inertial(0.2, (0.001, 0.001, 0.001), "0 0 0.05")}</link>
{
    _joint(
        "bend",
        "revolute",
        "palm",
        "finger",
        'xyz="0.05 0 0"',
        "0 1 0",
        'lower="-1" upper="1" velocity="9" effort="20"',
    )
}
{
    _joint(
        "follow",
        "revolute",
        "palm",
        "follower",
        'xyz="-0.05 0 0"',
        "0 1 0",
        'lower="-3" upper="3" velocity="9" effort="20"',
    ).replace("<limit", '<mimic joint="bend" multiplier="-2" offset="0.1"/><limit')
}
<link name="tip"/>
<joint name="end" type="fixed"><parent link="finger"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
</robot>"""

_BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
_PILE_LIMIT = 'lower="-1" upper="1" velocity="1" effort="9"'
_PILE = f"""<robot name="kit_pile">
<link name="a">{_inertial(1.0, (0.01, 0.01, 0.01))}{_BALL}</link>
<link name="b">{_inertial(1.0, (0.01, 0.01, 0.01))}{_BALL}</link>
<link name="c">{_inertial(1.0, (0.01, 0.01, 0.01))}{_BALL}</link>
{_joint("ab", "revolute", "a", "b", 'xyz="0 0 0.19"', "0 1 0", _PILE_LIMIT)}
{_joint("bc", "revolute", "b", "c", 'xyz="0 0 -0.04"', "0 0 1", _PILE_LIMIT)}
</robot>"""

_TEXTS = {"kit_arm": _ARM, "kit_lift": _LIFT, "kit_rover": _ROVER, "kit_gripper": _GRIPPER, "kit_pile": _PILE}

ARM = Robot(
    model="kit_arm",
    name="kit_arm",
    tcp="tool",
    home={"shoulder": 0.3, "elbow": -0.4},
    gains=DriveGains(stiffness=400.0, damping=30.0),
)
"""Two revolute joints whose axes and origins are turned every way, without shapes: it touches nothing."""

LIFT = Robot(
    model="kit_lift",
    name="kit_lift",
    tcp="table",
    gains=DriveGains(stiffness={"lift": 2000.0, "turn": 4.0}, damping={"lift": 150.0, "turn": 0.3}),
)
"""A table that is lifted and turned: its two joints do not feel each other, so the drive law has a closed form."""

LIFT_INERTIA = (3.0, 0.03)
"""Of the joints of :data:`LIFT` [kg, kg·m²]."""

LIFT_WEIGHT = (3.0, 0.0)
"""Share of the gravitational acceleration that pulls at the joints of :data:`LIFT` [kg, kg·m²]."""

LIFT_EFFORT_LIMIT = (200.0, 5.0)
"""Of the joints of :data:`LIFT` [N, N·m]."""

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
"""A finger whose tip is only a frame, and one that follows it: −2 times its angle, and 0.1 rad."""

PILE = Robot(model="kit_pile", name="kit_pile", tcp="c")
"""Three balls of 0.1 m: two pairs of neighbours, and a and c, which are :data:`PILE_DEPTH` in each other."""

PILE_DEPTH = 0.05
"""[m]"""


@lru_cache
def model_of(name: str) -> RobotModel:
    """Return the model of one of the kit's robots, read from a file as every other is.

    Args:
        name: ``Robot.model`` of the robot.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.urdf"
        path.write_text(_TEXTS[name])
        return load_model(path)
