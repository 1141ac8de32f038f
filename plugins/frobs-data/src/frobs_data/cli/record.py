"""``frobs record``: record episodes of a policy as a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.completion import complete_policy
from frobs_cli.options import EnvId, Json, NumEnvs, Simulator
from frobs_cli.output import only_json, working
from frobs_data.cli.data import print_summary
from frobs_train.cli.opened import ModelSettings, Trust


def record(
    environment: EnvId,
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", show_default=False, help="Folder of the data set to write.")
    ],
    policy: Annotated[
        str,
        typer.Option(
            "--policy",
            metavar="NAME",
            help="Policy to record: a name from 'frobs list policies', or the path of a run folder, bundle or model file.",
            autocompletion=complete_policy,
        ),
    ] = "expert",
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes to add to the data set.")] = 50,
    cameras: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            show_default=False,
            help="Cameras to record: names such as front,wrist, or settings by name as YAML or in a YAML file, such as "
            "'{wrist: {link: tool0, pos: [0, 0.05, 0], target: [0, 0, 0.2], fov_y: 60}}'.",
        ),
    ] = None,
    size: Annotated[
        tuple[int, int], typer.Option(metavar="H W", help="Height and width of the pictures in pixels, even numbers.")
    ] = (96, 96),
    success_only: Annotated[
        bool, typer.Option("--success-only", help="Record only successful episodes, until there are N of them.")
    ] = False,
    append: Annotated[bool, typer.Option("--append", help="Add the episodes to an existing data set.")] = False,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Seed of the first episode.")] = 0,
    num_envs: NumEnvs = None,
    simulator: Simulator = None,
    settings: ModelSettings = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Record episodes of a policy as a data set in the format LeRobotDataset v3.0.

    The data set also contains the start state of each episode, so that 'frobs data replay' can repeat it exactly.
    Ctrl-C stops the recording and keeps all whole episodes.

    Example:
        $ frobs record frobs/PandaPickAndPlace-v0 --episodes 50 --out data/pick
        $ frobs record frobs/PandaPickAndPlace-v0 --cameras overview --size 96 96 --success-only --out data/pictures
        $ frobs record frobs/Irb120Reach-v0 --policy pretrained --episodes 20 --out data/reach
        $ frobs record frobs/Irb120Reach-v0 --policy runs/first --episodes 20 --out data/reach --append
    """
    from frobs_data.recording import record as record_episodes

    def progress(kept: int, attempts: int) -> None:
        tried = f" ({attempts:,} attempts)" if success_only else ""
        show(f"recording: {kept:,} of {episodes:,} episodes{tried}")

    with only_json(json), working("recording") as show:
        dataset = record_episodes(
            environment,
            policy,
            episodes=episodes,
            out=out,
            seed=seed,
            num_envs=num_envs,
            cameras=_read_cameras(cameras),
            size=size,
            success_only=success_only,
            append=append,
            simulator=simulator,
            settings=settings or (),
            trust=trust,
            on_progress=progress,
        )
    print_summary(dataset, json)


def _read_cameras(text: str | None) -> Any:
    """Return the names or the settings of cameras."""
    from frobs_core.util.yaml import load_yaml, load_yaml_text

    if text is None:
        return None
    if text.endswith((".yaml", ".yml")):
        return load_yaml(text)
    return load_yaml_text(text, "--cameras") if ":" in text else [name.strip() for name in text.split(",")]
