from __future__ import annotations

import sys
from pathlib import Path

import pytest

# The contract is that of the algorithms in PyTorch, and so are the tests.
sys.path.insert(0, str(Path(__file__).parents[2] / "frobs-algos-sb3" / "tests"))

from frobs_algos_sb3_fixtures import Family, make, monitor, stopping_monitor  # noqa: F401


@pytest.fixture
def family() -> Family:
    return Family("sbx_", "policy.npz")
