"""A small environment on which everything about runs can be seen in a second."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import pytest

from frobs_train import Run, resolve_config, train

sys.path.append(str(Path(__file__).parent))  # for components_to_name, which configurations name

LINE = "FrobsTests/Line-v0"


class LineEnv(gym.Env[Any, Any]):
    """A point on a line that shall come to 0 and stay; says what FRobs environments say."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 10}

    def __init__(self, render_mode: str | None = None, width: float = 1.0) -> None:
        self.render_mode = render_mode
        self.width = width
        self.observation_space = gym.spaces.Box(-4.0, 4.0, (1,), np.float32)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.position = np.zeros(1)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.position = self.np_random.uniform(-self.width, self.width, 1)
        return self.position.astype(np.float32), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.position = np.clip(self.position + 0.2 * np.asarray(action), -4.0, 4.0)
        distance = float(abs(self.position[0]))
        terms = {"frobs/reward/distance": -distance, "frobs/reward/effort": -0.01 * float(np.abs(action).sum())}
        info = {"is_success": float(distance < 0.2), **terms}
        return self.position.astype(np.float32), sum(terms.values()), False, False, info

    def render(self) -> Any:
        frame = np.zeros((45, 61, 3), np.uint8)  # odd: H.264 wants even sizes
        frame[20:25, int(30 + 7 * self.position[0])] = 255
        return frame


class BlindLineEnv(LineEnv):
    """The same, without a picture."""

    def render(self) -> Any:
        return None


gym.register(LINE, LineEnv, max_episode_steps=10)
gym.register("FrobsTests/Blind-v0", BlindLineEnv, max_episode_steps=10, disable_env_checker=True)


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run on the line; do not change it."""
    config = resolve_config(
        LINE,
        flags={"num_envs": 4, "steps": 2000, "seed": 1, "checkpoint_every": 500, "keep_checkpoints": 2},
        settings=["algorithm_config.n_steps=50", "algorithm_config.learning_rate=1e-2", "algorithm_config.gamma=0.8"],
    )
    return train(config, tmp_path_factory.mktemp("runs") / "line")


@pytest.fixture
def copied(trained: Run, tmp_path: Path) -> Run:
    """The same, to be changed."""
    import shutil

    shutil.copytree(trained.path, tmp_path / "copy")
    return Run.open(tmp_path / "copy")
