"""Records of this distribution."""

from frobs_core.hookspecs import hookimpl
from frobs_core.specs import AlgorithmRecord


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Offer the algorithms."""
    return [
        AlgorithmRecord(
            name="ppo",
            summary="proximal policy optimization",
            entry_point="frobs_algos_sb3.ppo:PPO",
            install_hint="pip install frobs-algos-sb3",
            action_spaces=("Box", "Discrete", "MultiDiscrete", "MultiBinary"),
            tuned={
                "frobs/Irb120Reach-v0": "frobs_algos_sb3:tuned/ppo_irb120_reach.yaml",
                "frobs/Reach-v0": "frobs_algos_sb3:tuned/ppo_reach.yaml",
            },
        )
    ]
