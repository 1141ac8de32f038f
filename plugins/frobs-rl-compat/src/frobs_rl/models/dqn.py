"""Deep Q-network."""

from frobs_rl_compat.training import DQN as DQN
