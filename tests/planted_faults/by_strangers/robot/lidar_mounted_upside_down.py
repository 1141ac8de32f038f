"""The lidar's frame is upside down, so that its rays run clockwise."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from frobs_robots_kobuki.kobuki import KOBUKI

_text = (files("frobs_robots_kobuki") / "models" / "kobuki.urdf.xacro").read_text("utf-8")
_model = Path(tempfile.mkdtemp()) / "kobuki.urdf.xacro"
_model.write_text(
    _text.replace('<origin xyz="0 0 ${lidar_height}"/>', '<origin xyz="0 0 ${lidar_height}" rpy="${pi} 0 0"/>'), "utf-8"
)
FAULTY = replace(KOBUKI, model=str(_model))
