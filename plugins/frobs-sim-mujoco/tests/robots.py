"""Small robots for tests, as text."""

from __future__ import annotations

from pathlib import Path

from frobs_core.contracts import CommandMode
from frobs_core.description import DifferentialDrive, DriveGains, Lidar, Placement, Robot
from frobs_core.models import Pose, load_model


def _inertial(mass: float, pos: str = "0 0 0", diagonal: float = 0.01) -> str:
    return (
        f'<inertial><origin xyz="{pos}"/><mass value="{mass}"/>'
        f'<inertia ixx="{diagonal}" ixy="0" ixz="0" iyy="{diagonal}" iyz="0" izz="{diagonal}"/></inertial>'
    )


def _shape(kind: str, pos: str = "0 0 0") -> str:
    return f'<collision><origin xyz="{pos}"/><geometry>{kind}</geometry></collision>'


def _arm(name: str, lengths: tuple[float, ...]) -> str:
    links = [f'<link name="base">{_inertial(2.0)}{_shape("<box size=&quot;0.1 0.1 0.1&quot;/>")}</link>']
    joints, parent, z = [], "base", 0.1
    for i, length in enumerate(lengths):
        middle = f"0 0 {length / 2}"
        shape = _shape(f'<cylinder radius="0.03" length="{length - 0.08}"/>', middle)
        links.append(f'<link name="link_{i}">{_inertial(1.0, middle)}{shape}</link>')
        joints.append(
            f'<joint name="joint_{i}" type="revolute"><parent link="{parent}"/><child link="link_{i}"/>'
            f'<origin xyz="0 0 {z}"/><axis xyz="0 1 0"/>'
            '<limit lower="-2.5" upper="2.5" velocity="3" effort="200"/></joint>'
        )
        parent, z = f"link_{i}", length
    links.append('<link name="tool"/>')
    joints.append(
        f'<joint name="tool" type="fixed"><parent link="{parent}"/><child link="tool"/><origin xyz="0 0 {z}"/></joint>'
    )
    return f'<robot name="{name}">{"".join(links + joints)}</robot>'


_BOX = f"""<robot name="drone"><link name="hull">{_inertial(1.0)}{_shape('<box size="0.2 0.2 0.1"/>')}</link>
<link name="flap">{_inertial(0.1, diagonal=0.001)}</link>
<joint name="hinge" type="revolute"><parent link="hull"/><child link="flap"/><origin xyz="0.1 0 0.1"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="5" effort="5"/></joint></robot>"""


def _rover() -> str:
    hull = f'<link name="hull">{_inertial(2.4)}{_shape("<cylinder radius=&quot;0.15&quot; length=&quot;0.08&quot;/>")}'
    casters = "".join(_shape('<sphere radius="0.02"/>', f"{x} 0 -0.049") for x in (-0.1, 0.1))
    wheels, joints = "", ""
    for side, y in (("left", 0.115), ("right", -0.115)):
        wheel = '<collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.035" length="0.02"/></geometry>'
        wheels += f'<link name="{side}_wheel">{_inertial(0.2, diagonal=0.0005)}{wheel}</collision></link>'
        joints += (
            f'<joint name="{side}" type="continuous"><parent link="hull"/><child link="{side}_wheel"/>'
            f'<origin xyz="0 {y} -0.035"/><axis xyz="0 1 0"/><limit velocity="50" effort="20"/></joint>'
        )
    return f'<robot name="rover">{hull}{casters}</link>{wheels}{joints}</robot>'


ROBOTS = {
    "arm": Robot(model="", name="arm", tcp="tool", home={"joint_0": 0.3, "joint_1": 0.5}),
    "long_arm": Robot(model="", name="long_arm", tcp="tool", home={"joint_1": -0.4}),
    "drone": Robot(model="", name="drone", tcp="hull", base="floating"),
    "rover": Robot(
        model="",
        name="rover",
        tcp="hull",
        base="wheeled",
        gains=DriveGains(stiffness=0.0, damping=2.0),
        sensors={
            "lidar": Lidar(frame="hull", rays=8, angle_min=-3.1415, angle_max=2.3561, range_min=0.1, range_max=30.0)
        },
        differential_drive=DifferentialDrive(
            left=("left",),
            right=("right",),
            separation=0.23,
            wheel_radius=0.035,
            max_linear_velocity=1.0,
            max_angular_velocity=1.0,
        ),
    ),
}
_TEXTS = {
    "arm": _arm("arm", (0.3, 0.25)),
    "long_arm": _arm("long_arm", (0.3, 0.25, 0.2)),
    "drone": _BOX,
    "rover": _rover(),
}


def place(
    folder: Path, name: str, mode: CommandMode = CommandMode.POSITION, pos: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Placement:
    """Write a robot's URDF and return it placed."""
    path = folder / f"{name}.urdf"
    path.write_text(_TEXTS[name].replace("&quot;", '"'))
    return Placement(robot=ROBOTS[name], model=load_model(path), pose=Pose(pos=pos), command_mode=mode)
