"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import AlgorithmRecord


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Offer the algorithm."""
    return [
        AlgorithmRecord(
            name="climb",
            summary="Hill climbing with a linear policy",
            entry_point="acme_algo_climb.climb:Climb",
            install_hint="pip install acme-algo-climb",
        )
    ]
