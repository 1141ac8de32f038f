"""FRobs environments in LeRobot: ``lerobot-eval --env.type=frobs --env.task=PandaPickAndPlace-v0``.

LeRobot imports this package because the name of its distribution begins with ``lerobot_env_``. The import registers the
environment type ``frobs`` if LeRobot is installed.
"""

from importlib.util import find_spec

import gymnasium

GYM_ID = "lerobot_env_frobs/Environment-v0"
"""Gymnasium ID of all FRobs environments in LeRobot's format. The keyword ``task`` chooses the FRobs ID."""

gymnasium.register(GYM_ID, entry_point="lerobot_env_frobs.environment:make")

if find_spec("lerobot") is not None:
    from lerobot_env_frobs.config import FrobsEnv as FrobsEnv

__all__ = ["GYM_ID"]
