"""``frobs parity``: the certificate that a task means the same on another simulator."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.model_options import PackagePath, XacroArgs, robot_keywords
from frobs_cli.options import Controller, EnvId, Json, Robot, Tcp
from frobs_cli.output import console, only_json, print_json, print_line, print_note, print_table, print_title

if TYPE_CHECKING:
    from frobs_devkit.parity import Certificate

_STYLES = {"passed": "green", "failed": "bold red", "skipped": "dim"}


def parity(
    env_id: EnvId,
    simulators: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME…",
            show_default="the environment's simulator, then every other one that can be used here",
            help="Simulators to compare. The first one is the reference.",
        ),
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN", show_default=False, help="Run folder whose policy is evaluated on each simulator, too."
        ),
    ] = None,
    episodes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of episodes of the --run policy on each simulator.")
    ] = 200,
    actions: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            dir_okay=False,
            show_default="generated smooth actions",
            help="File with actions to replay: .json or .npz with id, seed and actions.",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(metavar="NAME,NAME…", show_default="all", help="Measurements to make; all others are left out."),
    ] = None,
    controller: Controller = None,
    robot: Robot = None,
    tcp: Tcp = None,
    args: XacroArgs = None,
    package_path: PackagePath = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", file_okay=False, show_default="parity/ID", help="Folder to write the certificate to."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Measure how closely simulators agree on an environment, and write a certificate.

    Compares kinematics, drives, gravity, contacts, lidar, rewards and the policy of a run. Each comparison has an
    error, a tolerance and a picture. Exits with status 1 if an error exceeds its tolerance (✗). If a simulator does
    not support a measurement, the measurement is skipped (–) and the reason is shown.

    Example:
        $ frobs parity frobs/Irb120Reach-v0 --simulators mujoco,pybullet
        $ frobs parity frobs/Irb120Reach-v0 --run runs/first --out certificate
        $ frobs parity frobs/Irb120Reach-v0 --only replay --actions actions.json --json
        $ frobs parity frobs/Reach-v0 --robot arm.urdf --tcp tool0 --package-path ~/ros/src
    """
    from frobs_core.registry import bare_id, find_spec

    spec = find_spec(env_id)
    from frobs_devkit.parity import measure_parity
    from frobs_train import Run

    names = _split(simulators) or _installed(str(spec.kwargs.get("simulator", "mujoco")))
    folder = out or Path("parity") / bare_id(env_id)
    keywords = robot_keywords(robot, tcp, args, package_path) | ({"controller": controller} if controller else {})
    with only_json(json), console(stderr=True).status("comparing") as status:
        certificate = measure_parity(
            env_id,
            names,
            run=Run.open(run) if run else None,
            actions=actions,
            only=_split(only) or None,
            episodes=episodes,
            keywords=keywords,
            on_measurement=lambda title: status.update(f"{title.lower()}: {', '.join(names)}"),
        )
        certificate.write(folder)
    if json:
        print_json({"folder": folder, **certificate.to_dict()})
    else:
        _print(certificate, folder)
    if not certificate.passed:
        raise typer.Exit(1)


def _split(names: str | None) -> list[str]:
    """Return the names of a list with commas."""
    return [name.strip() for name in (names or "").split(",") if name.strip()]


def _installed(own: str) -> list[str]:
    """Return the simulators that can be used here, the environment's own first."""
    from frobs_core import plugins

    return [own, *(name for name in plugins.importable("simulator") if name != own)]


def _print(certificate: Certificate, folder: Path) -> None:
    from rich.text import Text

    from frobs_devkit.parity.report import SIGNS, rows

    print_title(certificate.id, f"compared with {certificate.reference}")
    print_line()
    table: list[list[str | Text]] = []
    for measurement in certificate.measurements:
        for i, (comparison, cells) in enumerate(rows(measurement)):
            simulator, quantity, error, tolerance, note = cells
            sign = Text(SIGNS[comparison.status], style=_STYLES[comparison.status])
            title = measurement.title if i == 0 else ""
            table.append([title, sign, simulator, quantity, error, tolerance, note])
    print_table(
        (
            "measurement",
            "",
            "simulator",
            "quantity",
            "error",
            "tolerance",
            "where the error is largest, or why skipped",
        ),
        table,
    )
    print_line()
    console().print(certificate.verdict, style="bold green" if certificate.passed else "bold red", soft_wrap=True)
    print_note(f"written to {folder}: certificate.md, certificate.json, pictures, curves and actions")
