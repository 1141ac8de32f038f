"""FRobs_RL's two templates, to inherit or to copy: ``CustomRobotEnv`` and ``CustomTaskEnv``."""
