"""Transfer of progress from jobs on a cluster to the waiting command."""

from __future__ import annotations

import time
from typing import Any

import ray
from ray.actor import ActorHandle
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

_EVERY = 0.5  # [s] between messages of one job


class _Mailbox:
    """Stores the latest progress of each job until it is collected."""

    def __init__(self) -> None:
        self._latest: dict[Any, Any] = {}

    def put(self, key: Any, progress: Any) -> None:
        self._latest[key] = progress

    def take(self) -> dict[Any, Any]:
        latest, self._latest = self._latest, {}
        return latest


def open_mailbox() -> ActorHandle[Any]:
    """Start a mailbox on the node of this process; it reserves no processor."""
    here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=False)
    actor: Any = ray.remote(_Mailbox)
    handle: ActorHandle[Any] = actor.options(num_cpus=0, scheduling_strategy=here).remote()
    return handle


class Sender:
    """Sends the progress of jobs, at most twice a second per key.

    Args:
        mailbox: Mailbox from :func:`open_mailbox`.
    """

    def __init__(self, mailbox: ActorHandle[Any]) -> None:
        self._mailbox = mailbox
        self._next: dict[Any, float] = {}

    def send(self, key: Any, progress: Any) -> None:
        """Send the progress of the job, or of the part of a job, that ``key`` identifies."""
        now = time.monotonic()
        if now >= self._next.get(key, 0.0):
            self._next[key] = now + _EVERY
            self._mailbox.put.remote(key, progress)


def collect(mailbox: ActorHandle[Any]) -> dict[Any, Any]:
    """Return the progress that was sent since the last call, by key."""
    reference: Any = mailbox.take.remote()
    found: dict[Any, Any] = ray.get(reference)
    return found
