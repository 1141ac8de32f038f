"""A job as a Ray task: it runs on any node, and again on another one if its node or process dies."""

from __future__ import annotations

import logging
import traceback
from typing import Any

from ray.actor import ActorHandle

from frobs_ray.mailbox import Sender
from frobs_ray.nodes import Versions, describe_differences, flat_versions
from frobs_train.runners.runner import Job
from frobs_train.training.monitor import Progress
from frobs_train.training.threads import processors_limited_to

RETRIES = 5
"""How often a job is started again after its node or process has died."""

Answer = tuple[Any, str | None, str]
"""Result; error message or None; traceback. Exceptions stay on their node, because not all of them can be pickled."""


def run_job(job: Job, index: int, mailbox: ActorHandle[Any], processors: int, expected: Versions) -> Answer:
    """Run a job on this node.

    Args:
        job: The job.
        index: Its key in the mailbox.
        mailbox: Receives the progress.
        processors: Number of processors that it may use.
        expected: The versions of the machine that gave the job. A node that joined later is checked here.
    """
    logging.getLogger("frobs").setLevel(logging.ERROR)  # notices of a continued run: the command reports its progress
    differences = describe_differences(expected, flat_versions())
    if differences:
        return None, f"its node differs from the machine of this command: {'; '.join(differences)}.", ""
    sender = Sender(mailbox)

    def report(progress: Progress) -> None:
        sender.send(index, progress)

    try:
        with processors_limited_to(processors):
            return job.call(report), None, ""
    except Exception as error:
        return None, str(error) or type(error).__name__, traceback.format_exc()
