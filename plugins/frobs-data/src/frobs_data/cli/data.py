"""``frobs data``: show, check and edit data sets."""

from __future__ import annotations

from enum import StrEnum
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.formats import percent
from frobs_cli.options import Json
from frobs_cli.output import print_json, print_line, working

if TYPE_CHECKING:
    from frobs_data import Dataset

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", show_default=False, help="Folder of the data set.")]
Out = Annotated[Path, typer.Option(metavar="FOLDER", show_default=False, help="New folder to write.")]


class Format(StrEnum):
    """Formats of ``frobs data export``."""

    minari = "minari"


def show(
    folder: Folder,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            dir_okay=False,
            help="Also draw the first pictures and the distribution of the actions as a PNG file.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Show the size, the success rate and the features of a data set.

    Example:
        $ frobs data show demos
        $ frobs data show demos --picture demos.png
    """
    from frobs_data import Dataset
    from frobs_data.picture import draw

    dataset = Dataset(folder)
    drawn = None if picture is None else draw(dataset, picture)
    print_summary(dataset, json, picture=drawn)


def check(folder: Folder, json: Json = False) -> None:
    """Read everything in a data set, including the videos, and report what is wrong.

    Exits with status 1 if there is a problem.

    Example:
        $ frobs data check demos
    """
    from frobs_data import check as check_dataset

    with working(f"reading {folder}"):
        problems = check_dataset(folder)
    if json:
        print_json({"problems": problems})
    else:
        for line in problems[:100] or ["no problems found"]:
            print_line(line)
    if problems:
        raise typer.Exit(1)


def merge(
    folders: Annotated[
        list[Path], typer.Argument(metavar="FOLDER...", show_default=False, help="Folders of the data sets.")
    ],
    out: Out,
) -> None:
    """Combine data sets of the same robot, rate and features into a new one.

    Videos are copied without loss.

    Example:
        $ frobs data merge monday tuesday --out both
    """
    from frobs_data import merge as merge_datasets

    with working("merging"):
        made = merge_datasets(folders, out)
    print_line(f"{out}: {len(made.episodes):,} episodes, {len(made):,} frames")


def split(
    folder: Folder,
    part: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=PART",
            show_default=False,
            help="Name of a part, and a fraction of the episodes ('train=0.9') or the episodes ('test=0-9,20'). Repeat "
            "the option for each part.",
        ),
    ],
    out: Out,
) -> None:
    """Divide a data set into several new ones, each in a folder below --out.

    Videos are copied without loss.

    Example:
        $ frobs data split demos --part train=0.9 --part test=0.1 --out parts
        $ frobs data split demos --part first=0-9 --part rest=10-99 --out parts
    """
    from frobs_data import split as split_dataset

    parts = dict(map(_read_part, part))
    if len(parts) < len(part):
        raise CommandLineError("--part", "each part must have a name of its own.")
    with working("splitting"):
        made = split_dataset(folder, parts, out)
    for name, dataset in made.items():
        print_line(f"{out / name}: {len(dataset.episodes):,} episodes, {len(dataset):,} frames")


def export(
    folder: Folder,
    to: Annotated[Format, typer.Option(show_default=False, help="Format to write.")],
    name: Annotated[str, typer.Option(metavar="ID", show_default=False, help="ID of the Minari data set.")],
) -> None:
    """Write the vectors, actions and rewards of a data set in another format.

    Example:
        $ frobs data export demos --to minari --name frobs/pick-v0
    """
    from frobs_data.edit import export_minari

    with working(f"writing for {to}"):
        path = export_minari(folder, name)
    print_line(str(path))


def _read_part(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    try:
        if "." in value or value == "1":
            return name, float(value)
        ranges = [(first, last or first) for first, _, last in (item.partition("-") for item in value.split(","))]
        return name, [i for first, last in ranges for i in range(int(first), min(int(last), 10**6) + 1)]
    except ValueError:
        raise CommandLineError("--part", f"'{text}' is not NAME=0.9 or NAME=0-9,20.") from None


def print_summary(dataset: Dataset, json: bool, **more: Any) -> None:
    """Print the size, the success rate and the features of a data set, and further facts."""
    lengths = [episode.length for episode in dataset.episodes] or [0]
    features: list[dict[str, Any]] = []
    success = None
    for name, feature in dataset.features.items():
        shape = " × ".join(map(str, feature.shape))
        features.append({"name": name, "type": feature.dtype, "shape": shape, "min": None, "max": None})
        if feature.is_numeric and dataset.episodes:
            values = dataset.columns([name])[name]
            features[-1] |= {"min": float(values.min()), "max": float(values.max())}
            if name == "next.success":
                success = float(values.reshape(len(values), -1)[[end - 1 for end in accumulate(lengths)], 0].mean())
    facts = {
        "name": str(dataset.folder),
        "kind": "data set",
        "robot_type": dataset.robot_type,
        "episodes": len(dataset.episodes),
        "frames": len(dataset),
        "fps": dataset.fps,
        "length": {"shortest": min(lengths), "longest": max(lengths), "mean": sum(lengths) / len(lengths)},
        "hours": len(dataset) / dataset.fps / 3600,
        "success_rate": success,
        "tasks": list(dataset.tasks),
        "features": features,
        **more,
    }
    if json:
        print_json({**facts, "settings": dataset.settings})
    else:
        print_facts(
            {**facts, "success_rate": None if success is None else percent(success), "tasks": facts["tasks"][:5]}
        )
