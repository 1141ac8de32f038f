"""Statistics of finished episodes."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_train.logs.recorder import FinishedEpisodes

Arrays = Mapping[str, np.ndarray[Any, Any]]


class EpisodeStatistics:
    """Statistics of the episodes since the last row of the log, and of the last 100 episodes."""

    def __init__(self) -> None:
        self._since: list[FinishedEpisodes] = []
        self.recent_rewards: deque[float] = deque(maxlen=100)
        self.recent_lengths: deque[int] = deque(maxlen=100)
        self.recent_successes: deque[float] = deque(maxlen=100)

    def add(self, finished: FinishedEpisodes) -> None:
        """Add the episodes that ended at a step."""
        self._since.append(finished)
        self.recent_rewards.extend(finished.rewards.tolist())
        self.recent_lengths.extend(finished.lengths.tolist())
        if finished.successes is not None:
            self.recent_successes.extend(finished.successes.tolist())

    def take_row(self, terms: Sequence[str]) -> dict[str, float | None]:
        """Return the means over all episodes since the last call, as columns of the log.

        ``terms`` contains the names of all reward terms. Means are None if no episode has ended since the last call.
        """
        episodes, self._since = self._since, []
        row: dict[str, float | None] = {"episode/count": sum(len(item.env_ids) for item in episodes)}
        row["episode/reward"] = _mean([item.rewards for item in episodes])
        row["episode/length"] = _mean([item.lengths.astype(np.float64) for item in episodes])
        row["episode/success"] = _mean([item.successes for item in episodes if item.successes is not None])
        for name in terms:
            row[f"reward/{name}"] = _mean([item.terms[name] for item in episodes if name in item.terms])
        return row

    def snapshot(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return the state of the statistics as arrays."""
        recent = {"rewards": self.recent_rewards, "lengths": self.recent_lengths, "successes": self.recent_successes}
        types = {"lengths": np.int64}
        since: dict[str, list[np.ndarray[Any, Any]]] = {}
        for item in self._since:
            results = {"env_ids": item.env_ids, "rewards": item.rewards, "lengths": item.lengths}
            results |= {} if item.successes is None else {"successes": item.successes}
            for name, values in {**results, **{f"terms/{term}": sums for term, sums in item.terms.items()}}.items():
                since.setdefault(name, []).append(values)
        return {
            **{f"recent/{name}": np.array(values, types.get(name, np.float64)) for name, values in recent.items()},
            **{f"since/{name}": np.concatenate(parts) for name, parts in since.items()},
        }

    def restore(self, arrays: Arrays) -> None:
        """Restore a snapshot."""
        for name in ("recent_rewards", "recent_lengths", "recent_successes"):
            setattr(self, name, deque(arrays[name.replace("_", "/")].tolist(), maxlen=100))
        self._since = []
        if "since/env_ids" in arrays:
            prefix = "since/terms/"
            self._since.append(
                FinishedEpisodes(
                    env_ids=arrays["since/env_ids"],
                    rewards=arrays["since/rewards"],
                    lengths=arrays["since/lengths"],
                    successes=arrays.get("since/successes"),
                    terms={key.removeprefix(prefix): arrays[key] for key in arrays if key.startswith(prefix)},
                )
            )


def _mean(parts: list[np.ndarray[tuple[int], np.dtype[np.float64]]]) -> float | None:
    return float(np.concatenate(parts).mean()) if parts else None
