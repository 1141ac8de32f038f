"""``frobs play``: watch a policy, or record a video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.options import CheckpointName, LongestEpisode, Randomized
from frobs_cli.output import print_line, working
from frobs_core.util.errors import ConflictingOptionsError, RenderingUnavailableError, RunError
from frobs_train.cli.opened import PolicyChoice, RunOrId


def play(
    run: RunOrId,
    policy: PolicyChoice,
    video: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", dir_okay=False, help="Write an MP4 video to this file instead of opening a window."
        ),
    ] = None,
    viewer: Annotated[
        bool, typer.Option("--viewer", help="Show a window until Ctrl-C is pressed. This is the default.")
    ] = False,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes in the --video file.")] = 3,
    randomized: Randomized = False,
    checkpoint: CheckpointName = "newest",
    longest_episode: LongestEpisode = None,
) -> None:
    """Watch a policy in a window, or record a video.

    Use the policy of a run or a bundle, or with --policy, any policy in an environment.

    Example:
        $ frobs play frobs/Irb120Reach-v0 --policy pretrained
        $ frobs play frobs/PandaStack-v0 --policy expert --video stack.mp4
        $ frobs play runs/first
        $ frobs play runs/first --video first.mp4
        $ frobs play frobs/Irb120Reach-v0 --policy trained_model.zip
    """
    if video is not None and viewer:
        raise ConflictingOptionsError(["--video", "--viewer"])
    from frobs_train import record_video, view

    opened = policy.open(run)
    if video is None:
        try:
            view(opened, randomized=randomized, checkpoint=checkpoint, longest_episode=longest_episode)
        except RenderingUnavailableError as error:
            raise RunError(f"{error}. To record a video instead, repeat the command with --video FILE.") from error
        return
    with working("recording") as show:
        path = record_video(
            opened,
            video,
            episodes=episodes,
            randomized=randomized,
            checkpoint=checkpoint,
            longest_episode=longest_episode,
            on_progress=lambda frames: show(f"recording: {frames:,} frames"),
        )
    print_line(str(path))
