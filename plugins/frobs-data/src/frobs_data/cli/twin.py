"""``frobs data twin``: settings of a simulation that behaves like a recorded robot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.options import Json, Simulator
from frobs_cli.output import only_json, print_json, print_line, print_note, print_table, working
from frobs_data.cli.data import Folder
from frobs_train.cli.opened import Trust

if TYPE_CHECKING:
    from frobs_data.twin import Twin


def twin(
    folder: Folder,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", dir_okay=False, help="YAML file to write, for 'frobs train --config FILE'."),
    ] = None,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes to use, from the first.")] = 10,
    max_delay: Annotated[int, typer.Option(metavar="STEPS", min=1, help="Longest delay in control steps.")] = 10,
    simulator: Simulator = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Identify delay, jitter, noise and the gains of the drives of a recorded robot, and write them for training.

    The data set must contain commands and measured joint positions of motions in free space: 'frobs record' with the
    simulator 'ros2' or another real robot, or 'frobs data import'. Quantities that the motions do not determine are listed,
    and not written.

    Example:
        $ frobs data twin data/robot --out twin.yaml
        $ frobs train frobs/Irb120Reach-v0 --config twin.yaml
    """
    from frobs_core.util.files import write_text
    from frobs_core.util.yaml import dump_yaml
    from frobs_data.twin import identify

    with only_json(json), working("identifying") as show:
        found = identify(
            folder,
            episodes=episodes,
            max_delay=max_delay,
            simulator=simulator,
            trust=trust,
            on_progress=show,
        )
    block = {"randomize": found.block()}
    text = dump_yaml(block)
    if out is not None:
        write_text(out, text)
    if json:
        print_json({**vars(found), **block})
        return
    print_table(["quantity", "value", "standard error"], _rows(found))
    for problem in found.problems:
        print_note(f"not identified: {problem}")
    print_line()
    for line in text.splitlines():
        print_line(line)
    if out is not None:
        print_note(f"written to {out}")


def _rows(found: Twin) -> list[list[str]]:
    milliseconds = 1e3 * found.control_timestep
    rows: list[list[Any]] = [
        [f"delay in episode {i}", f"{milliseconds * each.value:.0f} ms", f"{milliseconds * each.error:.1f} ms"]
        for i, each in enumerate(found.delays)
    ]
    rows += [["jitter", f"{milliseconds * found.jitter:.0f} ms", ""]]
    rows += [[f"noise of {name}", f"{value:.3g}", ""] for name, value in found.noise.items()]
    rows += [[name, f"× {each.value:.3f}", f"{each.error:.1%}"] for name, each in found.gains.items()]
    return [*rows, ["error of the simulated positions", f"{found.tracking_error:.3g}", ""]]
