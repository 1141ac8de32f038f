"""Runs jobs as Ray tasks. If the node or process of a job dies, Ray restarts the job on any node."""

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
"""Maximum number of times that a job is restarted after its node or process has died."""

Answer = tuple[Any, str | None, str]
"""The result, the error message or None, and the traceback.

The exception itself is not returned, because some exceptions cannot be pickled.
"""


def run_job(job: Job, index: int, mailbox: ActorHandle[Any], processors: int, expected: Versions) -> Answer:
    """Run a job on this node.

    Args:
        job: The job.
        index: Key of the job in the mailbox.
        mailbox: Mailbox that receives the progress.
        processors: Number of processors for the job.
        expected: Software versions on the machine that submitted the job. The node's versions are compared with these
            versions, because the node may have joined the cluster after the job was submitted.
    """
    logging.getLogger("frobs").setLevel(logging.ERROR)  # hide notices, because the command already shows the progress
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
