"""Twin delayed deep deterministic policy gradient (TD3)."""

from frobs_rl_compat.training import TD3 as TD3
