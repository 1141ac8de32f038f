"""A replay buffer of arrays that replaces RLlib's buffer of episodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from ray.rllib.core.columns import Columns
from ray.rllib.env.single_agent_episode import SingleAgentEpisode
from ray.rllib.utils.metrics.metrics_logger import MetricsLogger
from ray.rllib.utils.replay_buffers.base import ReplayBufferInterface

Array = np.ndarray[Any, Any]


class Transitions(dict[str, Array]):
    """Sampled transitions, as arrays keyed by RLlib's column names. ``len()`` returns the number of transitions."""

    def __len__(self) -> int:
        return len(self[Columns.REWARDS])


class ReplayBuffer(ReplayBufferInterface):
    """Replay buffer that stores the most recent transitions and samples uniformly, without priorities.

    RLlib's buffer processes each transition of a batch separately in Python, whereas this buffer indexes arrays.
    """

    def __init__(self, capacity: int, seed: int) -> None:
        self.capacity = capacity
        self._generator = np.random.default_rng(seed)
        self._columns: dict[str, Array] = {}
        self._size, self._next = 0, 0
        self._metrics: Any = MetricsLogger(root=False)

    def __len__(self) -> int:
        return self._size

    def add(self, batch: Sequence[SingleAgentEpisode], **kwargs: Any) -> None:
        """Add the steps of episode fragments to the buffer."""
        observations = [episode.observations.data for episode in batch]
        rows = {
            Columns.OBS: np.concatenate([values[:-1] for values in observations]),
            Columns.NEXT_OBS: np.concatenate([values[1:] for values in observations]),
            Columns.ACTIONS: np.concatenate([episode.actions.data for episode in batch]),
            Columns.REWARDS: np.concatenate([episode.rewards.data for episode in batch]),
        }
        last = np.cumsum([len(episode) for episode in batch]) - 1
        rows[Columns.TERMINATEDS] = np.zeros(len(rows[Columns.REWARDS]), np.bool_)
        rows[Columns.TERMINATEDS][last] = [episode.is_terminated for episode in batch]
        count = len(rows[Columns.REWARDS])
        if not self._columns:
            self._columns = {
                name: np.empty((self.capacity, *values.shape[1:]), values.dtype) for name, values in rows.items()
            }
        where = (self._next + np.arange(count)) % self.capacity
        for name, values in rows.items():
            self._columns[name][where[-self.capacity :]] = values[-self.capacity :]
        self._next = (self._next + count) % self.capacity
        self._size = min(self._size + count, self.capacity)

    def sample(self, num_items: int, **kwargs: Any) -> list[Transitions]:  # type: ignore[override]
        """Return a list that contains one batch of ``num_items`` transitions."""
        chosen = self._generator.integers(self._size, size=num_items)
        batch = Transitions({name: values[chosen] for name, values in self._columns.items()})
        batch["weights"] = np.ones(num_items, np.float32)
        batch["n_step"] = np.ones(num_items, np.float32)
        return [batch]

    def get_metrics(self) -> Any:
        """Return empty metrics in RLlib's format."""
        return self._metrics.reduce()

    def update_priorities(self, *args: Any, **kwargs: Any) -> None:
        """Ignore priorities, because sampling is uniform."""

    def get_state(self) -> dict[str, Any]:
        """Return an empty state, because resumed training fills a new buffer."""
        return {}

    def set_state(self, state: dict[str, Any]) -> None:
        """Ignore the saved state."""
