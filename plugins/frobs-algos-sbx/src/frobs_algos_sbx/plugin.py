"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import AlgorithmRecord

_ANY = ("Box", "Discrete", "MultiDiscrete", "MultiBinary")


def _record(name: str, cls: str, summary: str, action_spaces: tuple[str, ...] = ("Box",)) -> AlgorithmRecord:
    module = "ppo" if name == "ppo" else "off_policy"
    return AlgorithmRecord(
        name=f"sbx_{name}",
        summary=f"{summary}, in JAX",
        entry_point=f"frobs_algos_sbx.{module}:{cls}",
        install_hint="pip install frobs-algos-sbx",
        action_spaces=action_spaces,
    )


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Offer the algorithms."""
    return [
        _record("ppo", "SbxPPO", "proximal policy optimization", _ANY),
        _record("sac", "SbxSAC", "soft actor-critic"),
        _record("td3", "SbxTD3", "twin delayed deep deterministic policy gradient"),
        _record("tqc", "SbxTQC", "truncated quantile critics"),
        _record("crossq", "SbxCrossQ", "soft actor-critic with batch normalization instead of target networks"),
        _record("dqn", "SbxDQN", "deep Q network", ("Discrete",)),
    ]
