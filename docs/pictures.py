"""Draw the pictures of the README anew: ``python docs/pictures.py RUN`` with a run of frobs/Irb120Reach-v0.

Writes an episode in three moments, the learning curve of the run, and the maze to ``docs/images``.
"""

import sys
from pathlib import Path

import gymnasium as gym
import imageio.v3 as iio
import numpy as np

from frobs_train import Run, plot_runs
from frobs_train.runs.policy import load_policy

IMAGES = Path(__file__).parent / "images"
SIZE = (900, 900)  # (height, width) that is drawn [pixels]
CROP = (slice(150, 750), slice(190, 710))  # what is shown of it: the arm
MOMENTS = (0, 6, 50)  # control steps
START = {"goal": [0.3, 0.24, 0.42], "joint_positions": [-1.3, 0.1, 0.2, 0.0, 0.6, 0.0]}
GAP = 8  # [pixels]


def draw_episode(run: Run) -> np.ndarray:
    """Return three moments of an episode side by side, (height, width, 3) uint8."""
    env = gym.make(run.config.environment, **run.config.environment_kwargs, render_mode="rgb_array", render_size=SIZE)
    policy, _ = load_policy(run, env.observation_space, env.action_space)
    observation, _ = env.reset(seed=0, options=START)
    moments = []
    for step in range(max(MOMENTS) + 1):
        if step in MOMENTS:
            moments += [env.render()[CROP], np.full((600, GAP, 3), 255, np.uint8)]
        if step < max(MOMENTS):
            action, _ = policy.predict(observation[None])
            observation, *_, info = env.step(action[0])
    env.close()
    assert info["is_success"], "this run does not hold the goal; take a better one"
    return np.concatenate(moments[:-1], axis=1)


def draw_maze() -> np.ndarray:
    """Return the maze at the beginning of an episode, (height, width, 3) uint8."""
    env = gym.make("frobs_core:frobs/KobukiMaze-v0", render_mode="rgb_array", render_size=(600, 800))
    env.reset(seed=3)
    picture: np.ndarray = env.render()[70:530]
    env.close()
    return picture


if __name__ == "__main__":
    opened = Run.open(sys.argv[1])
    iio.imwrite(IMAGES / "reach.png", draw_episode(opened))
    plot_runs([opened], IMAGES / "learning_curve.png")
    iio.imwrite(IMAGES / "maze.png", draw_maze())
