"""FRobs environments in LeRobot: ``lerobot-eval --env.type=frobs --env.task=PandaPickAndPlace-v0``.

LeRobot imports this package because the name of its distribution begins with ``lerobot_env_``. The import registers the
environment type ``frobs`` if LeRobot is installed.
"""

from importlib.util import find_spec

from lerobot_env_frobs.environment import GYM_ID as GYM_ID

if find_spec("lerobot") is not None:
    from lerobot_env_frobs.config import FrobsEnv as FrobsEnv

__all__ = ["GYM_ID"]
