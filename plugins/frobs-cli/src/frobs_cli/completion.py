"""Names for shell completion.

The shell sets ``_FROBS_COMPLETE`` while it completes a command line. With this variable set, importing the core neither
registers environments nor imports heavy packages. The suggested names are read from the plugins' records.
"""

from __future__ import annotations


def complete_id(incomplete: str) -> list[str]:
    """Return the environment IDs that begin with the ``incomplete`` text, from all plugins."""
    from frobs_core import plugins
    from frobs_core.plugins.records import TaskRecord

    ids = [environment.id for record in plugins.records(TaskRecord).values() for environment in record.environments]
    return sorted(id for id in ids if id.startswith(incomplete))


def complete_policy(incomplete: str) -> list[str]:
    """Return the names of policies that begin with the ``incomplete`` text. Policies that open paths are omitted."""
    from frobs_core import plugins
    from frobs_core.plugins.records import PolicyRecord

    records = plugins.records(PolicyRecord)
    return [name for name, record in records.items() if name.startswith(incomplete) and not record.suffixes]


def complete_kind(incomplete: str) -> list[str]:
    """Return the plural names of the record kinds, and ``envs``, that begin with the ``incomplete`` text."""
    from frobs_cli.catalogue import EXTENSIONS, plural
    from frobs_core.plugins.records import KINDS

    kinds = (*map(plural, (*KINDS, *EXTENSIONS)), "envs")
    return [word for word in kinds if word.startswith(incomplete)]
