"""Watch a policy in a window."""

from __future__ import annotations

import time
from contextlib import ExitStack, closing, suppress

from frobs_train.environments import make_env
from frobs_train.evaluation.video import play_steps
from frobs_train.runs.policy import acting_policy
from frobs_train.runs.run import Run


def view(
    run: Run,
    *,
    episodes: int | None = None,
    randomized: bool = False,
    checkpoint: str | int = "newest",
    longest_episode: int | None = None,
) -> int:
    """Play the policy of a checkpoint in a window, in real time, until Ctrl-C is pressed.

    Args:
        run: The run.
        episodes: Maximum number of episodes, or None for no limit.
        randomized: Whether to use the training run's randomization instead of the nominal models.
        checkpoint: See :func:`frobs_train.evaluate`.
        longest_episode: See :func:`frobs_train.evaluate`. By default, episodes without a time limit may be endless.

    Returns:
        The number of finished episodes.

    Raises:
        RenderingUnavailableError: There is no display.
        ConfigurationError: The environment cannot be shown in a window.
        CheckpointError: The checkpoint does not exist, or no checkpoint is usable.
    """
    env = make_env(
        run.config.environment,
        run.config.keywords(randomize=randomized),
        render_mode="human",
        wrappers=run.config.wrappers,
    )
    # Environments of other packages limit their own speed in ``render``. FRobs environments have a control timestep.
    control_timestep = float(getattr(env.unwrapped, "control_timestep", 0.0))
    begun, due = 0, 0.0
    with ExitStack() as stack:
        stack.enter_context(suppress(KeyboardInterrupt))
        stack.callback(env.close)
        policy = stack.enter_context(closing(acting_policy(run, env, checkpoint)))
        for step in play_steps(env, policy, episodes, run.seeds.evaluation, longest_episode):
            if step == 0:
                begun += 1
                due = time.perf_counter()
                continue
            due += control_timestep
            time.sleep(max(0.0, due - time.perf_counter()))
        begun += 1
    return max(0, begun - 1)
