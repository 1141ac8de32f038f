"""``frobs bench``: where the time of a step goes."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from frobs_cli.facts import print_facts
from frobs_cli.model_options import PackagePath, XacroArgs, robot_keywords
from frobs_cli.options import Controller, EnvId, Json, Robot, Simulator, Tcp
from frobs_cli.output import console, only_json, print_json


def bench(
    env_id: EnvId,
    num_envs: Annotated[int, typer.Option(metavar="N", min=1, help="Environments stepped together.")] = 1,
    steps: Annotated[int, typer.Option(metavar="N", min=10, help="Steps to measure.")] = 1000,
    robot: Robot = None,
    tcp: Tcp = None,
    args: XacroArgs = None,
    package_path: PackagePath = None,
    simulator: Simulator = None,
    controller: Controller = None,
    json: Json = False,
) -> None:
    """Measure where the time of a step goes, and how much more it is than the bare engine's.

    The bare engine replays the same states with the same controls; the two take turns, a few steps each.

    Example:
        $ frobs bench frobs/Irb120Reach-v0
        $ frobs bench frobs/Irb120Reach-v0 --num-envs 1024 --steps 100
        $ frobs bench frobs/Reach-v0 --robot arm.urdf --tcp tool0 --package-path ~/ros/src
    """
    from frobs_core.registry import find_spec

    find_spec(env_id)
    from frobs_devkit.bench import bench as measure

    keywords: dict[str, Any] = {"simulator": simulator, "controller": controller}
    given = robot_keywords(robot, tcp, args, package_path)
    given |= {key: value for key, value in keywords.items() if value is not None}
    with only_json(json), console(stderr=True).status(f"measuring {steps:,} steps"):
        found = measure(env_id, num_envs=num_envs, steps=steps, **given)
    if json:
        print_json(found)
        return
    facts = {
        "name": env_id,
        "kind": "1 environment" if num_envs == 1 else f"{num_envs:,} environments",
        "step": f"{_time(found.step_seconds)}, of {found.decimation} physics steps; median of {found.steps:,}",
        "steps_per_second": f"{found.steps_per_second:,.0f}",
        "bare_engine": "this simulator offers none" if found.bare_seconds is None else _time(found.bare_seconds),
        "ratio": None if found.ratio is None else f"{found.ratio:.2f}",
        "machine": found.machine,
        "parts": [
            {"part": part, "time": _time(seconds), "share": f"{100.0 * seconds / found.step_seconds:.0f} %"}
            for part, seconds in found.parts.items()
        ],
    }
    print_facts(facts)


def _time(seconds: float) -> str:
    """Return ``"83.1 µs"`` or ``"12.4 ms"``."""
    return f"{1e6 * seconds:.1f} µs" if seconds < 1e-3 else f"{1e3 * seconds:.2f} ms"
