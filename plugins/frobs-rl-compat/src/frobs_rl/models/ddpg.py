"""Deep deterministic policy gradient."""

from frobs_rl_compat.training import DDPG as DDPG
