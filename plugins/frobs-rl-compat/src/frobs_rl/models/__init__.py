"""FRobs_RL's algorithms. Each algorithm has its own module, such as ``frobs_rl.models.td3`` for ``TD3``."""
