"""FRobs_RL's wrappers, each in a module of its name: ``from frobs_rl.wrappers.TimeLimitWrapper import TimeLimitWrapper``."""
