"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import AlgorithmRecord


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Offer the algorithms of RLlib."""
    return []
