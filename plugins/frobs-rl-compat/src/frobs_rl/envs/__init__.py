"""FRobs_RL's base class of environments, in :mod:`frobs_rl.envs.robot_BasicEnv`."""
