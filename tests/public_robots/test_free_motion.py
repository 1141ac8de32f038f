"""Free motion is the same motion: every robot that both simulators build steps its joints alike, or it is known why not."""

from __future__ import annotations

import pytest

pytest.importorskip("pybullet_data")

from corpus import FAST, PARTED, REFUSED, UNDRAWN, files
from free_motion import TOLERANCE, free_motion

from frobs_core import plugins

PAIR = ("mujoco", "pybullet")
FILES = {name: file for name, file in files().items() if name not in {*REFUSED, *UNDRAWN}}
if missing := set(PAIR) - plugins.records("simulator").keys():
    pytest.skip(f"not installed: {', '.join(missing)}", allow_module_level=True)


@pytest.mark.parametrize("name", [n if n in FAST else pytest.param(n, marks=pytest.mark.slow) for n in sorted(FILES)])
def test_every_joint_steps_as_on_the_other_simulator(name):
    motion = free_motion(FILES[name], PAIR)
    assert motion.causes == PARTED.get(name, ()), motion
    assert motion.difference <= TOLERANCE or motion.causes or not motion.where, motion
