"""Records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_train import ConfigLayoutRecord


@hookimpl
def frobs_extensions() -> list[ConfigLayoutRecord]:
    """Return the records of FRobs_RL's YAML files, which have a section for one of its six algorithms."""
    return [
        ConfigLayoutRecord(
            name=f"frobs_rl_{algorithm}",
            summary=f"YAML files of FRobs_RL for {algorithm.upper()}",
            entry_point="frobs_rl_compat.training.translate:translate",
            install_hint="pip install frobs-rl-compat",
            key=f"model_params.{algorithm}_params",
            algorithm=algorithm,
        )
        for algorithm in ("ppo", "a2c", "ddpg", "dqn", "sac", "td3")
    ]
