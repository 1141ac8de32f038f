"""Names for shell completion.

A shell that completes a command line sets ``_FROBS_COMPLETE``. Importing the core then does not register environments
or import anything heavy; the names come from the plugins' records.
"""

from __future__ import annotations


def complete_id(incomplete: str) -> list[str]:
    """Return the environment IDs of all plugins that begin with a text."""
    from frobs_core import plugins
    from frobs_core.specs import TaskRecord

    ids = [
        environment.id
        for record in plugins.records("task").values()
        if isinstance(record, TaskRecord)
        for environment in record.environments
    ]
    return sorted(id for id in ids if id.startswith(incomplete))


def complete_kind(incomplete: str) -> list[str]:
    """Return the kinds of records, in plural, and ``envs``."""
    from frobs_core.specs import KINDS

    return [word for word in (*(f"{kind}s" for kind in KINDS), "envs") if word.startswith(incomplete)]
