"""FRobs_RL's two templates, which packages can subclass or copy: ``CustomRobotEnv`` and ``CustomTaskEnv``."""
