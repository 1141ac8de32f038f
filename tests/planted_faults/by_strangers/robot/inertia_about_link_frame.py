"""The inertias of the links refer to the links' frames instead of their centers of mass, so the distance counts twice."""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from frobs_robots_abb.irb120 import IRB120

_MODELS = files("frobs_robots_abb") / "models"
_NUMBER = r'="([-\d.e]+)"\s*'
_INERTIAL = re.compile(
    rf'<xacro:inertial mass{_NUMBER}com="([^"]+)" '
    + r"".join(rf"{name}{_NUMBER}" for name in ("ixx", "ixy", "ixz"))
    + "".join(rf"{name}{_NUMBER}" for name in ("iyy", "iyz", "izz"))
    + "/>"
)


def _from_cad(match: re.Match[str]) -> str:
    mass, (x, y, z) = float(match[1]), map(float, match[2].split())
    ixx, ixy, ixz, iyy, iyz, izz = (float(match[i]) for i in range(3, 9))
    return (
        f'<xacro:inertial mass="{mass}" com="{match[2]}" ixx="{ixx + mass * (y * y + z * z)}" '
        f'ixy="{ixy - mass * x * y}" ixz="{ixz - mass * x * z}" iyy="{iyy + mass * (x * x + z * z)}" '
        f'iyz="{iyz - mass * y * z}" izz="{izz + mass * (x * x + y * y)}"/>'
    )


_folder = Path(tempfile.mkdtemp())
(_folder / "parts.xacro").write_text((_MODELS / "parts.xacro").read_text("utf-8"), "utf-8")
_model = _folder / "irb120.urdf.xacro"
_model.write_text(_INERTIAL.sub(_from_cad, (_MODELS / "irb120.urdf.xacro").read_text("utf-8")), "utf-8")
FAULTY = replace(IRB120, model=str(_model))
