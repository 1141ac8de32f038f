"""FRobs_RL's class API: six algorithms of stable-baselines3, each configured by one YAML file.

The classes work with any Gymnasium environment, with or without ROS::

    from frobs_rl_compat.training import TD3

    model = TD3(env, "models/td3", "logs/td3", config_file_pkg="my_package", config_filename="td3.yaml")
    model.train()
"""

from frobs_rl_compat.training.basic_model import BasicModel
from frobs_rl_compat.training.logs import LogFolderExistsError
from frobs_rl_compat.training.models import A2C, DDPG, DQN, PPO, SAC, TD3
from frobs_rl_compat.training.saving import NotTrainedError
from frobs_rl_compat.training.settings import ROOT, PolicyParams, algorithms_in
from frobs_rl_compat.training.translate import translate

__all__ = [
    "A2C",
    "DDPG",
    "DQN",
    "PPO",
    "ROOT",
    "SAC",
    "TD3",
    "BasicModel",
    "LogFolderExistsError",
    "NotTrainedError",
    "PolicyParams",
    "algorithms_in",
    "translate",
]
