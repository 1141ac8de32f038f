"""What the tests of data sets share."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # for made_sets

from made_sets import make_set


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A joined data set with two cameras and three episodes; do not change it."""
    return make_set(tmp_path_factory.mktemp("sets") / "recorded", cameras=2)


@pytest.fixture
def copied(recorded: Path, tmp_path: Path) -> Path:
    """The same, to be changed."""
    import shutil

    return Path(shutil.copytree(recorded, tmp_path / "copied"))
