"""Measure the steps per second of another framework's manipulation environments.

``neighbours.py`` runs this script in the framework's own virtual environment, so it imports nothing from FRobs::

    python neighbour_speed.py FRAMEWORK SECONDS

The last line of the output is JSON: control steps per second by environment.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np


def gymnasium_env(module: str, id: str) -> Callable[[], Any]:
    """Return a function that creates a Gymnasium environment, which its module registers."""

    def make() -> Any:
        import gymnasium as gym

        package = __import__(module)
        if hasattr(gym, "register_envs"):
            gym.register_envs(package)
        return gym.make(id)

    return make


def robosuite_env() -> Any:
    """Create robosuite's Lift without cameras."""
    return __import__("robosuite").make(
        "Lift",
        robots="Panda",
        has_renderer=False,
        has_offscreen_renderer=False,
        use_camera_obs=False,
        control_freq=20,
        ignore_done=True,
    )


FRAMEWORKS: dict[str, dict[str, Callable[[], Any]]] = {
    "panda-gym": {
        "PandaPush-v3": gymnasium_env("panda_gym", "PandaPush-v3"),
        "PandaPickAndPlace-v3": gymnasium_env("panda_gym", "PandaPickAndPlace-v3"),
    },
    "Gymnasium-Robotics": {
        "FetchPush-v4": gymnasium_env("gymnasium_robotics", "FetchPush-v4"),
        "FetchPickAndPlace-v4": gymnasium_env("gymnasium_robotics", "FetchPickAndPlace-v4"),
    },
    "robosuite": {"Lift": robosuite_env},
}
EPISODE = 50
"""Number of steps after which an environment is reset."""


def measure(make: Callable[[], Any], seconds: float) -> float:
    """Return the steps per second with random actions, without resets and without the first episode, which compiles."""
    env = make()
    low, high = env.action_spec if hasattr(env, "action_spec") else (env.action_space.low, env.action_space.high)
    rng = np.random.default_rng(0)

    def episode() -> float:
        env.reset()
        start = time.perf_counter()
        for _ in range(EPISODE):
            env.step(rng.uniform(low, high))
        return time.perf_counter() - start

    episode()
    times: list[float] = []
    while sum(times) < seconds:
        times.append(episode())
    return EPISODE * len(times) / sum(times)


if __name__ == "__main__":
    found = {name: measure(make, float(sys.argv[2])) for name, make in FRAMEWORKS[sys.argv[1]].items()}
    sys.stdout.write(f"\n{json.dumps(found)}\n")
