"""The second finger of the gripper slides along the same axis as the first, so that both move to the left and the gripper never opens."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from frobs_grippers import PARALLEL_GRIPPER
from frobs_robots_ur.ur5 import UR5

_text = files("frobs_grippers").joinpath("models/parallel_gripper.urdf.xacro").read_text("utf-8")
_edited = _text.replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 1 0"/>')
assert _edited != _text
_path = Path(tempfile.mkdtemp()) / "parallel_gripper.urdf.xacro"
_path.write_text(_edited, "utf-8")

FAULTY = replace(UR5.attach("tool0", replace(PARALLEL_GRIPPER, model=str(_path))), name="ur5_gripper")
