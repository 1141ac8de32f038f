"""Registration of environment IDs."""

from gymnasium.envs.registration import EnvSpec

from frobs_rl_compat.old_gym.registration import EnvRegistry, make, register, registry, spec

__all__ = ["EnvRegistry", "EnvSpec", "make", "register", "registry", "spec"]
