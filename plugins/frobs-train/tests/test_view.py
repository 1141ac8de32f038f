from __future__ import annotations

import gymnasium as gym
import pytest
from gymnasium.envs.registration import EnvSpec

from frobs_core.util.errors import CheckpointError, FrobsError
from frobs_train import Run, view


def test_episodes_are_played_in_a_window(trained: Run) -> None:
    assert view(trained, episodes=2) == 2


def test_without_a_checkpoint_there_is_nothing_to_play(copied: Run) -> None:
    for checkpoint in copied.checkpoints:
        (checkpoint.path / "checksums.json").unlink()
    with pytest.raises(CheckpointError, match="no usable checkpoint"):
        view(copied, episodes=1)


def test_an_endless_episode_is_reported_if_it_is_limited(copied: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    endless = EnvSpec("FrobsTests/NeverEnding-v0", entry_point=gym.spec("FrobsTests/Line-v0").entry_point)
    monkeypatch.setitem(gym.registry, endless.id, endless)
    copied.config = copied.config.model_copy(update={"environment": "FrobsTests/NeverEnding-v0"})
    with pytest.raises(FrobsError, match=r"NeverEnding-v0.* 5 steps"):
        view(copied, episodes=1, longest_episode=5)
