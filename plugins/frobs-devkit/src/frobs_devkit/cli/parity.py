"""``frobs parity``: writes certificates that state how closely simulators agree."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.completion import complete_id, complete_policy
from frobs_cli.errors import CommandLineError
from frobs_cli.model_options import PackagePath, XacroArgs, robot_keywords
from frobs_cli.options import Controller, Json, Robot, Tcp
from frobs_cli.output import console, only_json, print_json, print_line, print_note, print_table, print_title, working
from frobs_core.util.errors import ConflictingOptionsError
from frobs_train.cli.runner_options import JobCpus, JobMemory, RayAddress, RunnerName, open_runner

if TYPE_CHECKING:
    from frobs_devkit.parity import Certificate

_STYLES = {"passed": "green", "failed": "bold red", "skipped": "dim"}


def parity(
    env_ids: Annotated[
        list[str],
        typer.Argument(
            metavar="ID...",
            show_default=False,
            help="Gymnasium environment ID from 'frobs list envs'. If several IDs are given, each gets its own "
            "certificate, and one table lists the results.",
            autocompletion=complete_id,
        ),
    ],
    simulators: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME…",
            show_default="the environment's simulator, followed by all other usable simulators",
            help="Simulators to compare. The first simulator is the reference.",
        ),
    ] = None,
    policy: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default=False,
            help="Policy that is also evaluated on each simulator: a name from 'frobs list policies', or the path of a "
            "run folder, bundle or model file. Requires a single ID.",
            autocompletion=complete_policy,
        ),
    ] = None,
    run: Annotated[
        Path | None, typer.Option(metavar="RUN", show_default=False, help="Short form of --policy for a run folder.")
    ] = None,
    episodes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of episodes to evaluate the --policy on each simulator.")
    ] = 200,
    actions: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            dir_okay=False,
            show_default="generated smooth actions",
            help="File with actions to replay: .json or .npz with the keys id, seed and actions. Requires a single ID.",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(metavar="NAME,NAME…", show_default="all", help="Measurements to perform; all others are skipped."),
    ] = None,
    controller: Controller = None,
    robot: Robot = None,
    tcp: Tcp = None,
    args: XacroArgs = None,
    package_path: PackagePath = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            file_okay=False,
            show_default="parity/ID",
            help="Folder to write the certificate to. If several IDs are given, each certificate gets its own "
            "subfolder.",
        ),
    ] = None,
    runner: RunnerName = "local",
    ray_address: RayAddress = None,
    cpus: JobCpus = None,
    memory: JobMemory = None,
    json: Json = False,
) -> None:
    """Measure how closely simulators agree on an environment, and write a certificate.

    The command compares kinematics, drives, gravity, contacts, lidar, rewards, and the success rate of a policy.
    The certificate contains the error and the tolerance of each comparison, and a plot of each measurement. Exits with
    status 1 if an error exceeds its tolerance (✗). If a simulator does not support a measurement, the measurement is
    skipped (–) and the reason is shown.

    If several IDs are given, each environment is measured in a separate job. If a job fails, the results of the other jobs
    are still printed.

    Example:
        $ frobs parity frobs/Irb120Reach-v0 --simulators mujoco,pybullet
        $ frobs parity frobs/Irb120Reach-v0 --policy runs/first --out certificate
        $ frobs parity frobs/Irb120Reach-v0 --only replay --actions actions.json --json
        $ frobs parity frobs/Reach-v0 --robot arm.urdf --tcp tool0 --package-path ~/ros/src
        $ frobs parity frobs/PandaPush-v0 frobs/PandaLift-v0 --runner ray
    """
    from frobs_core.plugins.registry import bare_id, find_spec

    specs = {env_id: find_spec(env_id) for env_id in env_ids}
    from frobs_devkit.parity import measure_parity
    from frobs_train import open_policy

    if run is not None and policy is not None:
        raise ConflictingOptionsError(["--policy", "--run"])
    chosen = open_runner(runner, ray_address, cpus, memory)
    names = {
        env_id: _split(simulators) or _installed(str(spec.kwargs.get("simulator", "mujoco")))
        for env_id, spec in specs.items()
    }
    keywords = robot_keywords(robot, tcp, args, package_path) | ({"controller": controller} if controller else {})
    if len(specs) > 1 or runner != "local":
        for option, value in (("--policy", policy), ("--run", run), ("--actions", actions)):
            if value is not None:
                raise CommandLineError(option, "this option requires a single ID and cannot be combined with --runner.")
        from frobs_devkit.cli.parity_jobs import certification_job, certify_and_report

        root = out or Path("parity")
        root.mkdir(parents=True, exist_ok=True)
        jobs = [
            certification_job(
                id, names[id], root / bare_id(id), only=_split(only) or None, keywords=_absolute(keywords)
            )
            for id in specs
        ]
        if not certify_and_report(jobs, chosen, root.absolute(), json=json):
            raise typer.Exit(1)
        return
    [env_id] = specs
    folder = out or Path("parity") / bare_id(env_id)
    with only_json(json), working("comparing") as show:
        certificate = measure_parity(
            env_id,
            names[env_id],
            run=open_policy(env_id, run or policy) if run or policy else None,
            actions=actions,
            only=_split(only) or None,
            episodes=episodes,
            keywords=keywords,
            on_measurement=lambda title: show(f"{title.lower()}: {', '.join(names[env_id])}"),
        )
        certificate.write(folder)
    if json:
        print_json({"folder": folder, **certificate.to_dict()})
    else:
        _print(certificate, folder)
    if not certificate.passed:
        raise typer.Exit(1)


def _absolute(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return an environment's keyword arguments with absolute paths, because a job may run in another folder."""
    kwargs = dict(keywords)
    if Path(str(kwargs.get("robot", ""))).is_file():
        kwargs["robot"] = str(Path(kwargs["robot"]).resolve())
    if "package_paths" in kwargs:
        kwargs["package_paths"] = {name: str(Path(path).resolve()) for name, path in kwargs["package_paths"].items()}
    return kwargs


def _split(names: str | None) -> list[str]:
    return [name.strip() for name in (names or "").split(",") if name.strip()]


def _installed(own: str) -> list[str]:
    """Return the names of the available simulators, starting with the environment's default simulator."""
    from frobs_core import plugins

    return [own, *(name for name in plugins.importable("simulator") if name != own)]


def _print(certificate: Certificate, folder: Path) -> None:
    from rich.text import Text

    from frobs_devkit.parity.certificate_text import SIGNS, rows

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
            "location of the largest error, or reason for skipping",
        ),
        table,
    )
    print_line()
    console().print(
        certificate.verdict, style="bold green" if certificate.passed else "bold red", soft_wrap=True, markup=False
    )
    print_note(
        f"The certificate was written to {folder}: certificate.md, certificate.json, images, curves and actions."
    )
