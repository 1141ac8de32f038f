"""Registered environments."""

from gym.envs.registration import make, register, registry, spec

__all__ = ["make", "register", "registry", "spec"]
