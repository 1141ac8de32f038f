"""Lets the tests of this folder import their helpers."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """The bundle of a two-joint arm whose action is the first two numbers of its observation."""
    from bundles import write

    return write(tmp_path / "arm.frobs")
