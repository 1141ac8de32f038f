"""FRobs_RL's templates ``CustomRobotEnv`` and ``CustomTaskEnv``, which packages can subclass or copy."""
