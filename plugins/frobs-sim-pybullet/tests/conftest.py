from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

# The same small robots as in the tests of the other engine, with which this one is compared.
sys.path.insert(0, str(Path(__file__).parents[2] / "frobs-sim-mujoco" / "tests"))

if find_spec("pybullet") is None:  # no wheel for this Python
    collect_ignore_glob = ["test_*.py"]
