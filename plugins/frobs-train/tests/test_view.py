from __future__ import annotations

import pytest

from frobs_core.util.errors import CheckpointError
from frobs_train import Run, view


def test_episodes_are_played_in_a_window(trained: Run) -> None:
    assert view(trained, episodes=2) == 2


def test_without_a_checkpoint_there_is_nothing_to_play(copied: Run) -> None:
    for checkpoint in copied.checkpoints:
        (checkpoint.path / "checksums.json").unlink()
    with pytest.raises(CheckpointError, match="no usable checkpoint"):
        view(copied, episodes=1)
