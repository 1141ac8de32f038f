"""Record a video of a policy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from itertools import chain, count
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core.contracts import Policy
from frobs_core.util.errors import ParameterValueError, RunError
from frobs_core.util.files import write_aside
from frobs_core.util.install_hints import local_install_hint
from frobs_core.util.validation import whole_number
from frobs_train.environment_checks import EpisodeChecks, fault_named, has_time_limit
from frobs_train.environments import make_env
from frobs_train.runs.policy import acting_policy
from frobs_train.runs.run import Run

Frame = npt.NDArray[np.uint8]
"""RGB image, (height, width, 3)."""


def record_video(
    run: Run,
    path: Path | str | None = None,
    *,
    episodes: int = 3,
    randomized: bool = False,
    checkpoint: str | int = "newest",
    on_progress: Callable[[int], object] | None = None,
    longest_episode: int | None = None,
) -> Path:
    """Record the policy of a checkpoint as a real-time MP4 video that browsers can play (H.264, yuv420p).

    Args:
        run: The run.
        path: File to write. Defaults to ``video.mp4`` in the run's folder.
        episodes: Number of episodes, ≥ 1. The episodes are seeded with the run's evaluation seed.
        randomized: Whether to use the training run's randomization instead of the nominal models.
        checkpoint: See :func:`frobs_train.evaluate`.
        on_progress: Called after each frame with the number of frames so far.
        longest_episode: See :func:`frobs_train.evaluate`.

    Returns:
        The path of the written file.

    Raises:
        RenderingUnavailableError: This machine cannot render images.
        RunError: imageio-ffmpeg is not installed, or the environment does not render RGB images.
        ConfigurationError: The environment cannot render, or a numeric argument is out of range.
        FrobsError: The checkpoint cannot be used, or the environment is faulty, see :func:`frobs_train.evaluate`.
    """
    whole_number("episodes", episodes, 1)
    longest = whole_number(
        "longest_episode", run.config.longest_episode if longest_episode is None else longest_episode, 1
    )
    try:
        import imageio_ffmpeg
    except ImportError as error:
        hint = local_install_hint("pip install 'frobs-train[video]'")
        raise RunError(f"recording a video requires imageio-ffmpeg; install it with: {hint}") from error

    target = Path(path) if path is not None else run.output("video.mp4")
    if target.suffix.lower() != ".mp4":
        raise ParameterValueError("video", str(target), "a file name that ends in .mp4")
    env = make_env(
        run.config.environment,
        run.config.keywords(randomize=randomized),
        render_mode="rgb_array",
        wrappers=run.config.wrappers,
    )
    with ExitStack() as stack:
        stack.callback(env.close)
        policy = stack.enter_context(closing(acting_policy(run, env, checkpoint)))
        steps = play_steps(env, policy, episodes, run.seeds.evaluation, longest)
        frames = (_picture(env) for _ in steps)
        first = next(frames)  # render before writing anything, because rendering may fail
        height, width = first.shape[:2]

        def write(aside: Path) -> None:
            writer = imageio_ffmpeg.write_frames(
                str(aside),
                (width, height),
                fps=frames_per_second(env),
                codec="libx264",
                pix_fmt_out="yuv420p",
                macro_block_size=1,
                output_params=["-movflags", "+faststart"],
            )
            writer.send(None)
            try:
                for number, frame in enumerate(chain([first], frames), 1):
                    writer.send(np.ascontiguousarray(frame))
                    if on_progress is not None:
                        on_progress(number)
            finally:
                writer.close()

        write_aside(target, write)
    return target


def play_steps(
    env: gym.Env[Any, Any], policy: Policy, episodes: int | None, seed: int, longest_episode: int | None = None
) -> Iterator[int]:
    """Play episodes in a single environment, and yield the step of the episode after each reset (0) and step.

    The seed is that of the first episode. If ``longest_episode`` is given, it limits episodes without a time limit.
    """
    checks = EpisodeChecks(env, None if has_time_limit(env) else longest_episode)
    for episode in count() if episodes is None else range(episodes):
        with fault_named(checks.environment, "reset"):
            observation, _ = env.reset(seed=seed if episode == 0 else None)
        checks.check_observation(add_batch(observation))
        done = np.ones(1, bool)
        yield 0
        while not (done.all() and checks.lengths.all()):
            action = policy.act(add_batch(observation), done)
            checks.check_action(action)
            with fault_named(checks.environment, "step"):
                observation, reward, terminated, truncated, info = env.step(action[0])
            checks.count_step(np.array([reward], np.float64), {key: [value] for key, value in info.items()})
            checks.check_observation(add_batch(observation))
            done = np.array([terminated or truncated])
            yield int(checks.lengths[0])
        checks.begin_again(done)


def add_batch(observation: Any) -> Any:
    """Add a batch dimension of size 1 to the observation of one environment."""
    if isinstance(observation, dict):
        return {key: np.asarray(value)[None] for key, value in observation.items()}
    return np.asarray(observation)[None]


def frames_per_second(env: gym.Env[Any, Any]) -> float:
    """Return the real-time frame rate [1/s], based on the control timestep or the environment's metadata."""
    control_timestep = getattr(env.unwrapped, "control_timestep", None)
    return 1.0 / control_timestep if control_timestep else float(env.metadata.get("render_fps", 30))


def _picture(env: gym.Env[Any, Any]) -> Frame:
    try:
        frame = env.render()
    except gym.error.Error as error:  # a package that the environment requires for rendering is missing
        raise RunError(f"cannot render: {error}") from error
    if not isinstance(frame, np.ndarray) or frame.ndim != 3 or frame.shape[2] != 3:
        raise RunError(f"{env.spec.id if env.spec else env} does not render RGB images; choose another environment.")
    # yuv420p requires an even height and width: repeat the last row or column if the size is odd.
    return np.pad(frame, ((0, frame.shape[0] % 2), (0, frame.shape[1] % 2), (0, 0)), mode="edge")
