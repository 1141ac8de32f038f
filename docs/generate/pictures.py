"""The pictures of the environments' pages: moments of an episode, and the learning curve of the policy that is shipped."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.errors import FrobsError
from frobs_train.evaluation.video import add_batch
from frobs_train.export.bundle_run import BundleRun
from frobs_train.plots.figures import dress, make_figure

SIZE = (450, 600)  # (height, width) of a moment [pixels]: the form that cameras of scenes are placed for
GAP = 6  # between moments [pixels]
SEEDS = range(4, 14)  # tried in this order until an episode is successful

logging.getLogger("OpenGL").setLevel(logging.WARNING)  # Sphinx would show what PyOpenGL tells of itself


def draw_episode(env_id: str, path: Path, run: BundleRun | None) -> bool:
    """Draw moments of an episode side by side; with a policy from beginning to end, without one only its beginning.

    Args:
        env_id: Gymnasium ID.
        path: The PNG.
        run: The trained policy that comes with the ID; None: there is none.

    Returns:
        Whether there is a picture: where nothing can be drawn, the page goes without, and the build goes on.
    """
    try:
        env = gym.make(env_id, render_mode="rgb_array", render_size=SIZE, disable_env_checker=True)
    except (FrobsError, gym.error.Error):
        return False
    try:
        frames = _moments(env, run)
    except (FrobsError, gym.error.Error):
        return False
    finally:
        env.close()
    gap = np.full((SIZE[0], GAP, 3), 255, np.uint8)
    strip = [part for frame in frames for part in (frame, gap)][:-1]
    _write_png(np.concatenate(strip, axis=1), path)
    return True


def _moments(env: gym.Env[Any, Any], run: BundleRun | None) -> list[np.ndarray]:
    if run is None:
        env.reset(seed=SEEDS[0])
        return [env.render()]
    policy = run.policy(env.observation_space, env.action_space)
    for seed in SEEDS:
        steps, succeeded = _wanted(env, policy, seed)
        if succeeded:
            break
    observation, _ = env.reset(seed=seed)
    frames = [env.render()]
    for step in range(1, max(steps) + 1):
        observation = env.step(_action(policy, observation, step == 1))[0]
        if step in steps:
            frames.append(env.render())
    return frames


def _wanted(env: gym.Env[Any, Any], policy: Any, seed: int) -> tuple[list[int], bool]:
    """Return which steps to draw after the beginning, and whether the episode is successful.

    These steps are the last step, and the first step whose reward is at least 30 % of the way to the highest reward.
    """
    observation, _ = env.reset(seed=seed)
    rewards, done = [], False
    while not done:
        observation, reward, terminated, truncated, info = env.step(_action(policy, observation, not rewards))
        rewards.append(float(reward))
        done = terminated or truncated
    highest = np.maximum.accumulate(rewards)
    middle = int(np.argmax(highest >= 0.7 * highest[0] + 0.3 * highest[-1])) + 1
    return sorted({max(1, middle), len(rewards)}), bool(info.get("is_success", True))


def _action(policy: Any, observation: Any, start: bool) -> Any:
    return policy.act(add_batch(observation), np.array([start]))[0]


def draw_curve(curve: dict[str, list[float | None]], path: Path) -> bool:
    """Draw the learning curve that a bundle tells: success, or else reward, over the time of the training.

    Returns:
        Whether there was anything to draw.
    """
    if len(curve.get("steps") or []) < 2:
        return False
    known = "success" if any(value is not None for value in curve["success"]) else "reward"
    rows = [(s, t, v) for s, t, v in zip(curve["steps"], curve["seconds"], curve[known], strict=True) if v is not None]
    try:
        figure = make_figure(6.4, 2.6)
    except FrobsError:
        return False
    axis = figure.subplots()
    dress(axis, x_label="environment steps", y_label=f"{known} in the training")
    axis.plot([row[0] for row in rows], [row[2] for row in rows], color="#b3450b", linewidth=2)
    if known == "success":
        axis.set_ylim(0.0, 1.03)
    axis.set_xlim(0, rows[-1][0])
    axis.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    _write(buffer.getvalue(), path)
    return True


def _write_png(picture: np.ndarray, path: Path) -> None:
    import imageio.v3 as iio

    _write(iio.imwrite("<bytes>", picture, extension=".png"), path)


def _write(data: bytes, path: Path) -> None:
    """Write a file, but not if it is there already: Sphinx builds anew what is younger."""
    if not path.exists() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
