"""Draw the animations of the README and of the gallery: ``python docs/pictures.py [ID …]``; without an ID, all of them.

Each ID with a trained policy or a scripted expert gets an animation of successful episodes, and every ID gets a still.
They are written to ``docs/images/gallery``. ``docs/images/hero.webp`` is the animation of the README.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from generate.environments import slug
from PIL import Image

from frobs_core.plugins import registry
from frobs_core.util.errors import RunError
from frobs_train import open_policy
from frobs_train.environments import make_env
from frobs_train.evaluation.video import add_batch
from frobs_train.runs.policy import acting_policy

IMAGES = Path(__file__).parent / "images"
GALLERY = IMAGES / "gallery"
DRAWN = (540, 720)  # (height, width) of a rendered image [pixels]
SIZE = (320, 240)  # (width, height) of an animation [pixels]
ARM = (100, 20, 660, 440)  # part of the image that shows an arm: (left, upper, right, lower) [pixels]
FRAMES = 36
STATES = 30  # minimum number of states in an animation; short episodes are repeated
DURATION, PAUSE = 80, 900  # of a frame, and of the last one [ms]
SEEDS = 30  # that are tried until the episodes succeed
PARTS = {
    "frobs/Lift-v0": {"robot": "irb140+parallel_gripper"},
    "frobs/Navigate-v0": {"robot": "kobuki", "floor_plan": "maze"},
    "frobs/PickAndPlace-v0": {"robot": "irb120+two_finger_hand"},
    "frobs/Push-v0": {"robot": "irb120+parallel_gripper"},
    "frobs/Reach-v0": {"robot": "panda_arm"},
    "frobs/Stack-v0": {"robot": "irb120+parallel_gripper"},
}
"""Parts of the IDs that leave them open."""
OPTIONS = {"pick_and_place": {"goal": [0.5, 0.15, 0.2]}}
"""Reset options by task, where a random episode may show only a part of the task."""
HERO = "frobs/PandaStackVision-v0"
"""ID of the README's animation."""
VIEW = {"pos": [1.25, -0.95, 0.85], "target": [0.28, 0.02, 0.3], "fov_y": 36}
"""Camera of the README's animation."""


def draw(env_id: str) -> None:
    """Write the still of an ID, and its animation if a policy or an expert solves its task."""
    task, record = registry.environments()[env_id]
    run = open_policy(env_id, "pretrained" if record.pretrained else "expert")
    keywords = {**run.config.keywords(), **PARTS.get(env_id, {}), "render_size": DRAWN}
    env = make_env(run.config.environment, keywords, render_mode="rgb_array", wrappers=run.config.wrappers)
    box = ARM if task.name.startswith("reach") else None

    def picture(frame: np.ndarray) -> Image.Image:
        return Image.fromarray(frame).resize(SIZE, Image.Resampling.LANCZOS, box)

    try:
        policy = acting_policy(run, env)
    except RunError:  # without a policy and without an expert
        env.reset(seed=SEEDS)
        write([picture(env.render())], slug(env_id))
        return
    states = successful_states(env, policy, OPTIONS.get(task.name) if record.robot else None)
    write([picture(states[int(i)]) for i in np.linspace(0, len(states) - 1, FRAMES)], slug(env_id))
    env.close()


def successful_states(
    env: Any, policy: Any, options: dict[str, Any] | None = None, seen: Sequence[str] = ()
) -> list[np.ndarray]:
    """Return images of all states of successful episodes, which begin with the given reset options.

    ``seen`` names the observations that are shown in a corner.
    """

    def picture() -> np.ndarray:
        return with_insets(env.render(), [observation[name] for name in seen])

    states: list[np.ndarray] = []
    for seed in range(SEEDS):
        observation, _ = env.reset(seed=seed, options=options)
        episode, done = [picture()], False
        while not done:
            action = policy.act(add_batch(observation), np.array([len(episode) == 1]))
            observation, _, terminated, truncated, info = env.step(action[0])
            episode.append(picture())
            done = terminated or truncated
        if info["is_success"]:
            states += episode
        if len(states) >= STATES:
            return states
    raise RuntimeError(f"{env.spec.id}: too few of {SEEDS} episodes succeed.")


def write(frames: Sequence[Image.Image], name: str, folder: Path = GALLERY) -> None:
    """Write a frame as a still, and if there are several, all of them as an animation."""
    folder.mkdir(parents=True, exist_ok=True)
    frames[len(frames) // 3].save(folder / f"{name}-still.webp", quality=70, method=6)
    if len(frames) > 1:
        durations = [DURATION] * (len(frames) - 1) + [PAUSE]
        frames[0].save(
            folder / f"{name}.webp",
            save_all=True,
            append_images=frames[1:],
            duration=durations,
            loop=0,
            quality=50,
            method=6,
        )


def draw_hero() -> None:
    """Write the animation of the README: a robot, and the camera pictures that its policy sees."""
    run = open_policy(HERO, "pretrained")
    keywords = {**run.config.keywords(), "render_size": (450, 800), "cameras": {"hero": VIEW}, "camera": "hero"}
    env = make_env(HERO, keywords, render_mode="rgb_array", wrappers=run.config.wrappers)
    states = successful_states(env, acting_policy(run, env), seen=("scene", "wrist"))
    write([Image.fromarray(states[int(i)]) for i in np.linspace(0, len(states) - 1, 2 * FRAMES)], "hero", IMAGES)
    env.close()


def with_insets(picture: np.ndarray, seen: Sequence[np.ndarray]) -> np.ndarray:
    """Return the picture with what the cameras see in its lower left corner, enlarged."""
    picture = picture.copy()
    for column, view in enumerate(seen):
        inset = view.repeat(2, axis=0).repeat(2, axis=1)
        height, width = inset.shape[:2]
        left, upper = 12 + column * (width + 12), picture.shape[0] - height - 12
        picture[upper - 2 : upper + height + 2, left - 2 : left + width + 2] = 255
        picture[upper : upper + height, left : left + width] = inset
    return picture


if __name__ == "__main__":
    for each in sys.argv[1:] or registry.environments():
        draw(each)
    draw_hero()
