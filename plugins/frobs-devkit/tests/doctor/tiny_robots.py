"""Tiny robots, as text."""

from __future__ import annotations

from frobs_devkit.doctor import Finding, RobotReport

BOX = '<geometry><box size="0.1 0.1 0.2"/></geometry>'
SOLID = f"<collision>{BOX}</collision>"
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="0.0042" ixy="0" ixz="0" iyy="0.0042" iyz="0" izz="0.0017"/></inertial>'
)
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="50"/>'


def link(name: str, content: str = INERTIAL + SOLID) -> str:
    """Return a link; what the default holds is plausible."""
    return f'<link name="{name}">{content}</link>'


def joint(name: str, parent: str, child: str, xyz: str = "0 0 0.3", kind: str = "revolute", more: str = LIMIT) -> str:
    """Return a joint about y."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="0 1 0"/>{more}</joint>'
    )


def robot(*parts: str) -> str:
    """Return a robot of two links and a joint, or of what is given."""
    return f'<robot name="tiny">{"".join(parts or (link("base"), link("arm"), joint("hinge", "base", "arm")))}</robot>'


def found(report: RobotReport, code: str) -> list[Finding]:
    """Return the findings of a kind."""
    return [finding for finding in report.findings if finding.code == code]
