"""A job as a Ray task. If its node or process dies, it is started again on any node."""

from __future__ import annotations

import logging
import traceback
from typing import Any

from ray.actor import ActorHandle

from frobs_ray.mailbox import Sender
from frobs_ray.nodes import Versions, difference_here
from frobs_train.runners.runner import Job
from frobs_train.training.monitor import Progress
from frobs_train.training.threads import processors_limited_to

RETRIES = 5
"""Maximum number of restarts of a job after its node or process died."""

Answer = tuple[Any, str | None, str]
"""Result; error message or None; traceback. Exceptions are not returned, because not all of them can be pickled."""


def run_job(job: Job, index: int, mailbox: ActorHandle[Any], processors: int, expected: Versions) -> Answer:
    """Run a job on this node.

    Args:
        job: The job.
        index: Key of the job in the mailbox.
        mailbox: Mailbox that receives the progress.
        processors: Number of processors of the job.
        expected: Versions on the submitting machine. They are checked here because a node may join the cluster later.
    """
    logging.getLogger("frobs").setLevel(logging.ERROR)  # no notices when a run continues; the command shows progress
    if difference := difference_here(expected):
        return None, difference, ""
    sender = Sender(mailbox)

    def report(progress: Progress) -> None:
        sender.send(index, progress)

    try:
        with processors_limited_to(processors):
            return job.call(report), None, ""
    except Exception as error:
        return None, str(error) or type(error).__name__, traceback.format_exc()
