from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from rllib_fixtures import cluster, make, monitor  # noqa: F401
from two_nodes import two_nodes  # noqa: F401
