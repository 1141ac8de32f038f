"""Stable-baselines3 algorithms for FRobs."""

from frobs_core.deprecation import keep_moved_modules

keep_moved_modules(
    {
        "frobs_algos_sb3.frobs_rl": ["frobs_rl_compat.training"],
        "frobs_algos_sb3.settings": ["frobs_algos.settings", "frobs_algos_sb3.config"],
        "frobs_algos_sb3.storage": ["frobs_algos.storage"],
    }
)
