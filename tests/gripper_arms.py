"""Arms with grippers for tests, as URDF files without meshes."""

from __future__ import annotations

INERTIAL = (
    '<inertial><mass value="{mass}"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def link(name: str, *boxes: str, mass: float = 0.2, visual: str = "") -> str:
    """Return a link with collision boxes, each ``"x y z of the size; x y z of the center"``."""
    shapes = []
    for box in boxes:
        size, _, center = box.partition(";")
        geometry = f'<geometry><box size="{size.strip()}"/></geometry>'
        shapes.append(f'<collision><origin xyz="{center.strip() or "0 0 0"}"/>{geometry}</collision>')
    return f'<link name="{name}">{INERTIAL.format(mass=mass)}{"".join(shapes)}{visual}</link>'


def joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    xyz: str = "0 0 0",
    axis: str = "0 0 1",
    limits: str = "",
    more: str = "",
) -> str:
    """Return a joint. ``limits`` are ``"lower upper"``."""
    limit = ""
    if limits:
        low, high = limits.split()
        limit = f'<limit lower="{low}" upper="{high}" velocity="3" effort="60"/>'
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}{more}</joint>'


def arm(axes: int = 6) -> str:
    """Return an arm of 0.8 m whose last link is ``wrist``. With four axes, the tool cannot turn by itself."""
    parts = [
        link("base", "0.1 0.1 0.1; 0 0 0.05", mass=5.0),
        link("l1", mass=2.0),
        link("l2", "0.04 0.04 0.3; 0 0 0.17", mass=2.0),
        link("l3", "0.04 0.04 0.26; 0 0 0.15", mass=1.0),
        link("wrist"),
        joint("j1", "revolute", "base", "l1", "0 0 0.15", "0 0 1", "-3 3"),
        joint("j2", "revolute", "l1", "l2", "0 0 0.05", "0 1 0", "-2 2"),
        joint("j3", "revolute", "l2", "l3", "0 0 0.35", "0 1 0", "-2.6 2.6"),
        joint("j4", "revolute", "l3", "l4" if axes > 4 else "wrist", "0 0 0.3", "0 1 0", "-2.6 2.6"),
    ]
    if axes > 4:
        parts += [link("l4"), joint("j5", "revolute", "l4", "l5" if axes > 5 else "wrist", "0 0 0.05", "0 0 1", "-3 3")]
    if axes > 5:
        parts += [link("l5"), joint("j6", "revolute", "l5", "wrist", "0 0 0.02", "1 0 0", "-2 2")]
    return "".join(parts)


FINGER = "0.02 0.01 0.06; 0 {} 0.03"


def two_fingers(stroke: float = 0.04, follow: bool = True, carrier: str = "wrist") -> str:
    """Return a palm with two sliding fingers 1 cm thick, which touch each other at 0 and open by ``stroke`` each."""
    mimic = '<mimic joint="left"/>' if follow else ""
    return (
        link("palm", "0.06 0.1 0.03; 0 0 0.015")
        + link("finger_a", FINGER.format(0.005))
        + link("finger_b", FINGER.format(-0.005))
        + joint("mount", "fixed", carrier, "palm")
        + joint("left", "prismatic", "palm", "finger_a", "0 0 0.03", "0 1 0", f"0 {stroke}")
        + joint("right", "prismatic", "palm", "finger_b", "0 0 0.03", "0 -1 0", f"0 {stroke}", mimic)
    )


def one_jaw(widest: float = 1.2) -> str:
    """Return a wrist with a fixed jaw, and a jaw that turns about x by up to ``widest`` [rad] and closes on it."""
    return (
        link("palm", "0.04 0.03 0.02; 0 0 0.01", "0.02 0.006 0.09; 0 -0.013 0.065")
        + link("jaw", "0.02 0.006 0.09; 0 0.003 0.045")
        + joint("mount", "fixed", "wrist", "palm")
        + joint("grip", "revolute", "palm", "jaw", "0 -0.01 0.02", "-1 0 0", f"0 {widest}")
    )


def robot(*parts: str) -> str:
    """Return the text of a URDF."""
    return f'<robot name="r">{"".join(parts)}</robot>'
