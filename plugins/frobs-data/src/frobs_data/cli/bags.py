"""``frobs data import``: episodes from ROS bags."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.completion import complete_id
from frobs_cli.field_options import option
from frobs_cli.options import Json, Simulator
from frobs_cli.output import only_json, print_note, working
from frobs_data.cli.data import print_summary


class Commands(StrEnum):
    """Sources of the commands in a bag."""

    forward = "forward"
    trajectory = "trajectory"
    measured = "measured"


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """Options of ``frobs data import``.

    Attributes:
        namespace: Namespace of the robot's topics.
        remap: Rename a topic, such as joint_states:=/arm/joint_states. Repeatable.
        commands: Topic that contains the commands of the robot. 'measured' uses the measured positions, for a robot
            that was guided by hand.
        goal: Goal of all episodes in meters, in the world frame.
        max_gap: Largest age of a measurement in seconds.
        task: Sentence that describes the task.
        settings: Setting of the environment, such as environment_kwargs.controller=joint_position. Repeatable.
    """

    namespace: str = option("", metavar="NS", show_default="none")
    remap: list[str] | None = option(None, metavar="FROM:=TO", show_default="none")
    commands: Commands | None = option(None, show_default="the topic that is in the bag")
    goal: tuple[float, float, float] | None = option(None, metavar="X Y Z", show_default="the goal in the bag")
    max_gap: float | None = option(None, metavar="S", show_default="three control steps, at least 0.2 s")
    task: str | None = option(None, metavar="TEXT", show_default="the sentence of the environment")
    simulator: Simulator = None
    settings: list[str] | None = option(None, name="set", metavar="KEY=VALUE", show_default="none")


def import_(
    bags: Annotated[
        list[Path],
        typer.Argument(metavar="BAG...", show_default=False, help="Folders of bags, or .mcap or .db3 files."),
    ],
    environment: Annotated[
        str,
        typer.Option(
            "--env",
            metavar="ID",
            show_default=False,
            help="Gymnasium ID of an environment with the same robot, for which the data set is.",
            autocompletion=complete_id,
        ),
    ],
    to: Annotated[Path, typer.Option("--to", metavar="FOLDER", show_default=False, help="New data set to write.")],
    options: ImportOptions,
    json: Json = False,
) -> None:
    """Import bags of ROS 2 as episodes of a data set.

    Each bag is one episode. Positions are read from 'joint_states', commands from the topics of ros2_control, goals from
    'goal', images from 'KEY/image_raw', and all other terms from 'observation', as by 'frobs ros2 run'. Messages are
    sampled at the control rate of the environment.

    Example:
        $ frobs data import first_bag second_bag --env frobs/Irb120Reach-v0 --to data/bags
        $ frobs data import arm.mcap --env frobs/Irb120Reach-v0 --goal 0.3 0.1 0.5 --commands measured --to data/hand
        $ frobs data import bag --env frobs/Ur5Reach-v0 --remap joint_states:=/ur/joint_states --to data/ur
    """
    from frobs_data.importing import import_bags

    chosen = vars(options) | {"remappings": options.remap or (), "settings": options.settings or ()}
    del chosen["remap"]
    with only_json(json), working("importing") as show:
        imported = import_bags(bags, environment, to, on_progress=show, **chosen)
    print_summary(imported.dataset, json, unreachable_commands=imported.unreachable)
    if imported.unreachable and not json:
        advice = "the data set contains the nearest actions"
        print_note(f"{imported.unreachable:,} commands are out of the controller's reach in one step; {advice}")
