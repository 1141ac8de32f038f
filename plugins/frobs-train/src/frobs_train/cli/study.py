"""``frobs study``: train and evaluate every combination of environments, algorithms and seeds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.output import print_line, print_note
from frobs_train.cli.jobs_progress import collect_outcomes, short_path
from frobs_train.cli.runner_options import RunnerChoice

if TYPE_CHECKING:
    from frobs_train.runners.runner import Job, Runner


def study(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", dir_okay=False, show_default=False, help="YAML file that describes the study."),
    ],
    runner: RunnerChoice,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            file_okay=False,
            show_default="the name of the file without its ending",
            help="Folder to write.",
        ),
    ] = None,
) -> None:
    """Train and evaluate environments × algorithms × seeds, and write one page with tables and pictures.

    The file has the keys 'environments', 'algorithms', 'seeds' (a number or a list), 'episodes' and 'settings' (as in a
    file for 'frobs train'). The command runs only the jobs that are not complete yet. To continue an interrupted study,
    or to extend a study after adding entries to the file, run the same command again.

    Example:
        $ frobs study reaching.yaml
        $ frobs study reaching.yaml --out results/reaching --runner ray
    """
    from frobs_train.comparison.study import missing_evaluations, missing_trainings, read_study, write_study

    described, folder = read_study(file), file.with_suffix("") if out is None else out
    if folder.is_file():
        raise CommandLineError("--out", f"{folder} is a file; choose a folder for the study.")
    chosen = runner.open()
    for title, jobs in (("train", missing_trainings), ("evaluate", missing_evaluations)):
        _run(title, jobs(described, folder), folder, chosen)
    page, found = write_study(described, folder)
    print_line(short_path(page.absolute()))
    for note in found.notes:
        print_note(note)


def _run(title: str, jobs: list[Job], folder: Path, runner: Runner) -> None:
    from frobs_train.comparison.study import run_jobs
    from frobs_train.runners.runner import raise_failures

    if jobs:
        print_line(f"{title}: {len(jobs)} run{'s' if len(jobs) > 1 else ''}")
        names = [job.name for job in jobs]
        raise_failures(
            collect_outcomes(
                names, lambda update: run_jobs(jobs, folder, runner, update), "repeat the command to continue"
            )
        )
