"""``frobs data replay``: repeat recorded episodes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note, print_table, working
from frobs_train.cli.opened import Trust


def replay(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", show_default=False, help="Data set written by 'frobs record'.")
    ],
    episode: Annotated[
        list[int] | None,
        typer.Option(metavar="N", min=0, show_default="all", help="Number of an episode to repeat. Repeatable."),
    ] = None,
    simulator: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="the simulator of the recording",
            help="Simulator that repeats the actions: a name from 'frobs list simulators'.",
        ),
    ] = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Repeat the actions of recorded episodes from their start states, and compare the results with the recording.

    On the simulator of the recording, all vectors and rewards must be identical bit for bit; otherwise, the exit status
    is 1. On another simulator, the command reports how fast the tool and the objects drift away from the recording.

    Example:
        $ frobs data replay data/pick
        $ frobs data replay data/pick --episode 0 --episode 7
        $ frobs data replay data/pick --simulator pybullet
    """
    from frobs_data.replaying import replay as replay_episodes

    with only_json(json), working("replaying") as show:
        results = replay_episodes(
            folder,
            episode,
            simulator=simulator,
            trust=trust,
            on_progress=lambda done: show(f"replaying: {done:,} episodes"),
        )
    if json:
        print_json([asdict(result) for result in results])
    elif results[:1] and results[0].drift is not None:
        rows = [
            [str(result.episode), *(f"{1e3 * each.largest:.1f} mm, {1e3 * each.per_second:.2f} mm/s" for each in drift)]
            for result in results
            if (drift := (result.drift or {}).values())
        ]
        print_table(["episode", *results[0].drift], rows)
        print_note("position error: the largest, and its increase per second")
    else:
        for result in results:
            if not result.identical:
                print_line(f"episode {result.episode} differs by up to {result.difference:.6g}")
        exact = sum(result.identical for result in results)
        print_line(f"{exact:,} of {len(results):,} episodes are identical bit for bit")
    if any(result.drift is None and not result.identical for result in results):
        raise typer.Exit(1)
