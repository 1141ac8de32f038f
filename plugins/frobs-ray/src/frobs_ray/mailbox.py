"""Transfers progress from jobs on a cluster to the command that is waiting for them."""

from __future__ import annotations

import time
from typing import Any

import ray
from ray.actor import ActorHandle
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

_EVERY = 0.5  # [s] minimum time between messages for one key


class _Mailbox:
    """Stores the latest progress of each job until the progress is collected."""

    def __init__(self) -> None:
        self._latest: dict[Any, Any] = {}

    def put(self, key: Any, progress: Any) -> None:
        self._latest[key] = progress

    def take(self) -> dict[Any, Any]:
        latest, self._latest = self._latest, {}
        return latest


def open_mailbox() -> ActorHandle[Any]:
    """Start a mailbox on the node of this process without reserving a processor."""
    here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=False)
    actor: Any = ray.remote(_Mailbox)
    handle: ActorHandle[Any] = actor.options(num_cpus=0, scheduling_strategy=here).remote()
    return handle


class Sender:
    """Sends the progress of jobs to a mailbox, at most twice per second for each key."""

    def __init__(self, mailbox: ActorHandle[Any]) -> None:
        self._mailbox = mailbox
        self._next: dict[Any, float] = {}

    def send(self, key: Any, progress: Any) -> None:
        """Send the progress of a job or of a part of a job, identified by ``key``."""
        now = time.monotonic()
        if now >= self._next.get(key, 0.0):
            self._next[key] = now + _EVERY
            self._mailbox.put.remote(key, progress)


def collect(mailbox: ActorHandle[Any]) -> dict[Any, Any]:
    """Return the latest progress that was sent since the last call, by key."""
    reference: Any = mailbox.take.remote()
    progress: dict[Any, Any] = ray.get(reference)
    return progress
