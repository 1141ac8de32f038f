"""FRobs_RL's wrappers. Each wrapper is in a module of the same name, such as ``frobs_rl.wrappers.TimeLimitWrapper``."""
