"""FRobs_RL's base class for environments, in :mod:`frobs_rl.envs.robot_BasicEnv`."""
