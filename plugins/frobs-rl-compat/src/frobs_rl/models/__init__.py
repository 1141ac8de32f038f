"""FRobs_RL's algorithms, each in a module of the same name: ``from frobs_rl.models.td3 import TD3``."""
