"""Plugin records of the core itself, which are available without an entry point."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import PolicyRecord


@hookimpl
def frobs_extensions() -> list[PolicyRecord]:
    """Return the records of the policies."""
    return [
        PolicyRecord(
            name="expert",
            summary="the scripted expert of the environment's task",
            entry_point="frobs_core.kernel.policies:ExpertPolicy",
            install_hint="pip install frobs-core",
        ),
        PolicyRecord(
            name="random",
            summary="random actions",
            entry_point="frobs_core.kernel.policies:RandomPolicy",
            install_hint="pip install frobs-core",
        ),
    ]
