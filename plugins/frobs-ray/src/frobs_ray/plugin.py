"""Records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord


def _record(name: str, place: str, summary: str, action_spaces: tuple[str, ...], **more: object) -> AlgorithmRecord:
    return AlgorithmRecord(
        name=f"rllib_{name}",
        summary=f"{summary}, from RLlib",
        entry_point=f"frobs_ray.rllib.{place}",
        install_hint="pip install frobs-ray",
        action_spaces=action_spaces,
        exact_resume=False,
        **more,  # type: ignore[arg-type]
    )


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Return the records of RLlib's algorithms."""
    return [
        _record(
            "ppo",
            "on_policy:RLlibPPO",
            "proximal policy optimization",
            ("Box", "Discrete"),
            tuned={"frobs/Irb120Reach-v0": "frobs_ray:tuned/ppo_irb120_reach.yaml"},
        ),
        _record("sac", "sac:RLlibSAC", "soft actor-critic", ("Box",)),
        _record("appo", "on_policy:RLlibAPPO", "asynchronous PPO", ("Box", "Discrete"), reproducible=False),
    ]
