from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for the helpers of this folder

from frobs_algos_sb3_fixtures import family, make, monitor, stopping_monitor  # noqa: F401
