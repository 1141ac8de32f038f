"""The inertia of each rod is that about its end (m·l²/3), although the inertial frame is in its middle."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from templates.my_arm import MY_ARM

_text = Path(MY_ARM.model).read_text("utf-8")
_edited = _text.replace("(3 * radius ** 2 + length ** 2) / 12", "(radius ** 2 / 4 + length ** 2 / 3)")
assert _edited != _text
_path = Path(tempfile.mkdtemp()) / "my_arm.urdf.xacro"
_path.write_text(_edited, "utf-8")

FAULTY = replace(MY_ARM, model=str(_path))
