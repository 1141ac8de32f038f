"""``frobs record``: record episodes of a policy as a data set."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.completion import complete_policy
from frobs_cli.field_options import option
from frobs_cli.options import EnvId, Json, NumEnvs, Simulator
from frobs_cli.output import only_json, working
from frobs_data.cli.data import print_summary
from frobs_train.cli.opened import ModelSettings, Trust


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """Options of ``frobs record``.

    Attributes:
        policy: Policy to record: a name from 'frobs list policies', or the path of a run folder, bundle or model file.
        episodes: Number of episodes to add to the data set.
        cameras: Cameras to record: names such as front,wrist, or settings by name as YAML or in a YAML file, such as
            '{wrist: {link: tool0, pos: [0, 0.05, 0], target: [0, 0, 0.2], fov_y: 60}}'.
        size: Height and width of the pictures in pixels, even numbers.
        success_only: Record only successful episodes, until there are N of them.
        append: Add the episodes to an existing data set.
        takeover: Policy through which a person can act instead of --policy: teleop, teleop:keyboard or teleop:gamepad.
        episode_steps: Time limit of an episode in control steps, which a person often needs to be longer.
        seed: Seed of the first episode.
    """

    policy: str = option("expert", autocompletion=complete_policy)
    episodes: int = option(50, min=1)
    cameras: str | None = option(None, metavar="NAMES")
    size: tuple[int, int] = option((96, 96), metavar="H W")
    success_only: bool = option(False)
    append: bool = option(False)
    takeover: str | None = option(None, autocompletion=complete_policy)
    episode_steps: int | None = option(None, min=1, show_default="the time limit of the environment")
    seed: int = option(0, metavar="S", min=0)
    num_envs: NumEnvs = None
    simulator: Simulator = None
    settings: ModelSettings = None
    trust: Trust = False


def record(
    environment: EnvId,
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", show_default=False, help="Folder of the data set to write.")
    ],
    options: RecordOptions,
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
        $ frobs record frobs/PandaLift-v0 --policy teleop --episodes 10 --out data/mine
        $ frobs record frobs/PandaLift-v0 --policy runs/clone --takeover teleop --episodes 10 --out data/corrections
    """
    from frobs_data.recording import record as record_episodes

    def progress(kept: int, attempts: int) -> None:
        tried = f" ({attempts:,} attempts)" if options.success_only else ""
        show(f"recording: {kept:,} of {options.episodes:,} episodes{tried}")

    with only_json(json), working("recording") as show:
        chosen = vars(options) | {"cameras": _read_cameras(options.cameras), "settings": options.settings or ()}
        limit = chosen.pop("episode_steps")
        chosen |= {} if limit is None else {"max_episode_steps": limit}
        dataset = record_episodes(environment, out=out, on_progress=progress, **chosen)
    print_summary(dataset, json)


def _read_cameras(text: str | None) -> Any:
    """Return the names or the settings of cameras."""
    from frobs_core.util.yaml import load_yaml, load_yaml_text

    if text is None:
        return None
    if text.endswith((".yaml", ".yml")):
        return load_yaml(text)
    return load_yaml_text(text, "--cameras") if ":" in text else [name.strip() for name in text.split(",")]
