"""``frobs parity``: writes certificates that state how closely simulators agree."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.completion import complete_id, complete_policy
from frobs_cli.errors import CommandLineError
from frobs_cli.field_options import option
from frobs_cli.model_options import RobotChoice
from frobs_cli.options import Controller, Json
from frobs_cli.output import console, only_json, print_json, print_line, print_note, print_table, print_title, working
from frobs_core.kernel.robot_file import absolute_files
from frobs_core.util.errors import ConflictingOptionsError
from frobs_train import Job, Progress, Runner, raise_failures
from frobs_train.cli.jobs_progress import collect_outcomes, short_path
from frobs_train.cli.runner_options import RunnerChoice

if TYPE_CHECKING:
    from frobs_devkit.parity import Certificate


_STYLES = {"passed": "green", "failed": "bold red", "skipped": "dim"}


@dataclass(frozen=True, kw_only=True)
class ParityOptions(RobotChoice):
    """Options of ``frobs parity``.

    Attributes:
        simulators: Simulators to compare. The first simulator is the reference.
        policy: Policy that is also evaluated on each simulator: a name from 'frobs list policies', or the path of a run
            folder, bundle or model file. Requires a single ID.
        run: Short form of --policy for a run folder.
        episodes: Number of episodes to evaluate the --policy on each simulator.
        actions: File with actions to replay: .json or .npz with the keys id, seed and actions. Requires a single ID.
        only: Measurements to perform; all others are skipped.
        out: Folder to write the certificate to. If several IDs are given, each certificate gets its own subfolder.
    """

    simulators: str | None = option(
        None,
        metavar="NAME,NAME…",
        show_default="the environment's simulator, followed by all other usable simulators",
    )
    policy: str | None = option(None, autocompletion=complete_policy)
    run: Path | None = option(None, metavar="RUN")
    episodes: int = option(200, min=1)
    actions: Path | None = option(None, dir_okay=False, show_default="generated smooth actions")
    only: str | None = option(None, metavar="NAME,NAME…", show_default="all")
    controller: Controller = None
    out: Path | None = option(None, metavar="DIR", file_okay=False, show_default="parity/ID")

    def keywords(self) -> dict[str, Any]:
        return super().keywords() | ({"controller": self.controller} if self.controller else {})


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
    options: ParityOptions,
    runner: RunnerChoice,
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
    from frobs_core import plugins
    from frobs_core.plugins.registry import bare_id, find_spec

    specs = {env_id: find_spec(env_id) for env_id in env_ids}
    from frobs_devkit.parity import measure_parity
    from frobs_train import open_policy

    run, policy, only = options.run, options.policy, _split(options.only) or None
    if run is not None and policy is not None:
        raise ConflictingOptionsError(["--policy", "--run"])
    chosen, keywords = runner.open(), options.keywords()
    names = {}
    for env_id, spec in specs.items():
        own = str(spec.kwargs.get("simulator", "mujoco"))
        names[env_id] = _split(options.simulators) or [own, *(name for name in plugins.engines() if name != own)]
    if len(specs) > 1 or not runner.is_local:
        for name, value in (("--policy", policy), ("--run", run), ("--actions", options.actions)):
            if value is not None:
                raise CommandLineError(name, "this option requires a single ID and cannot be combined with --runner.")

        root, absolute = options.out or Path("parity"), absolute_files(keywords)  # a job may run in another folder
        if paths := absolute.get("package_paths"):
            absolute["package_paths"] = {name: str(Path(path).resolve()) for name, path in paths.items()}
        root.mkdir(parents=True, exist_ok=True)
        jobs = [
            Job(
                name=id,
                function=f"{__name__}:certify",
                arguments={
                    "environment": id,
                    "simulators": tuple(names[id]),
                    "folder": (root / bare_id(id)).absolute(),
                    "keywords": {"only": only, "keywords": absolute},
                },
                memory=_MEMORY,
            )
            for id in specs
        ]
        if not _certify_all(jobs, chosen, root.absolute(), json=json):
            raise typer.Exit(1)
        return
    [env_id] = specs
    folder = options.out or Path("parity") / bare_id(env_id)
    with only_json(json), working("comparing") as show:
        certificate = measure_parity(
            env_id,
            names[env_id],
            run=open_policy(env_id, run or policy) if run or policy else None,
            actions=options.actions,
            only=only,
            episodes=options.episodes,
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


def _split(names: str | None) -> list[str]:
    return [name.strip() for name in (names or "").split(",") if name.strip()]


def _print(certificate: Certificate, folder: Path) -> None:
    from rich.text import Text

    from frobs_devkit.parity.certificate import SIGNS, rows

    print_title(certificate.id, f"compared with {certificate.reference}")
    print_line()
    table: list[list[str | Text]] = []
    for measurement in certificate.measurements:
        for i, (comparison, cells) in enumerate(rows(measurement)):
            simulator, quantity, error, tolerance, note = cells
            sign = Text(SIGNS[comparison.status], style=_STYLES[comparison.status])
            title = measurement.title if i == 0 else ""
            table.append([title, sign, simulator, quantity, error, tolerance, note])
    where = "location of the largest error, or reason for skipping"
    print_table(("measurement", "", "simulator", "quantity", "error", "tolerance", where), table)
    print_line()
    style = "bold green" if certificate.passed else "bold red"
    console().print(certificate.verdict, style=style, soft_wrap=True, markup=False)
    print_note(
        f"The certificate was written to {folder}: certificate.md, certificate.json, images, curves and actions."
    )


_MEMORY = 2 * 2**30  # [B] for Python and the engines


def certify(
    environment: str,
    simulators: Sequence[str],
    folder: Path,
    keywords: Mapping[str, Any],
    report: Callable[[Progress], bool | None],
) -> dict[str, Any]:
    """Measure how closely simulators agree on an environment, and write the certificate."""
    from frobs_devkit.parity import measure_parity

    certificate = measure_parity(environment, simulators, **keywords)
    certificate.write(folder)
    return {"folder": folder, **certificate.to_dict()}


def _certify_all(jobs: Sequence[Job], runner: Runner, folder: Path, *, json: bool) -> bool:
    """Run the jobs, print one row per environment, and return whether all environments passed."""
    with only_json(json):
        outcomes = collect_outcomes(
            [job.name for job in jobs],
            lambda update: runner.run(jobs, folder, update),
            f"the finished certificates are in {folder}",
        )
    done = [outcome.result for outcome in outcomes if outcome.error is None]
    rows = []
    for each in done:
        failed = ", ".join(one["title"].lower() for one in each["measurements"] if one["status"] == "failed")
        sign = "✓" if each["passed"] else "✗"
        rows.append([each["id"], sign, each["verdict"], failed or "–", short_path(each["folder"])])
    if json:
        print_json(done)
    elif done:
        print_table(["environment", "", "comparisons", "over the tolerance", "certificate"], rows)
    raise_failures(outcomes)
    return all(each["passed"] for each in done)
