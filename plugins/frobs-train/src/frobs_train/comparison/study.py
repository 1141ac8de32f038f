"""Studies: every combination of environments, algorithms and seeds, and one page with the results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

from frobs_core.util.files import write_aside
from frobs_core.util.plain import to_json
from frobs_core.util.validation import validate
from frobs_core.util.yaml import load_yaml
from frobs_train.comparison.compare import Comparison, compare
from frobs_train.comparison.tables import groups_table, markdown_table, runs_table, write_table
from frobs_train.configuration.resolve import resolve_config, usual_algorithm
from frobs_train.plots.plot_comparison import plot_comparison
from frobs_train.runners.jobs import evaluation_job, training_job
from frobs_train.runners.runner import Job, Outcome, Runner
from frobs_train.runs.evaluation_files import is_as_trained
from frobs_train.runs.run import Run, is_run
from frobs_train.training.monitor import Progress
from frobs_train.training.session import check_environment

PAGE = "README.md"
"""Name of the page in the folder of a study."""


class Study(BaseModel):
    """Every combination of environments, algorithms and seeds, with the tuned settings of each.

    Attributes:
        environments: Gymnasium IDs.
        algorithms: Names of algorithms, or None for the algorithm of each ID.
        seeds: Number of seeds, or the seeds themselves.
        episodes: Number of new episodes in which each policy is evaluated.
        settings: Settings that replace the tuned ones in all runs, as in a file for ``frobs train``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    environments: Annotated[list[str], Field(min_length=1)]
    algorithms: Annotated[list[str], Field(min_length=1)] | None = None
    seeds: Annotated[int, Field(ge=1)] | Annotated[list[Annotated[int, Field(ge=0, lt=2**32)]], Field(min_length=1)] = 5
    episodes: Annotated[int, Field(ge=1)] = 200
    settings: dict[str, Any] = {}

    @model_validator(mode="after")
    def _check(self) -> Study:
        for name in ("environments", "algorithms", "seeds"):
            values = getattr(self, name)
            if isinstance(values, list) and len(set(values)) < len(values):
                raise ValueError(f"{name}: {values} contains a value twice")
        for key in ("environment", "algorithm", "seed"):
            if key in self.settings:
                raise ValueError(f"settings.{key} would be ignored; write the key '{key}s' of the study instead")
        return self


def read_study(path: Path | str) -> Study:
    """Read the YAML file of a study, or raise ConfigFileError if it has an unknown key or an invalid value."""
    return validate(Study, load_yaml(path), "a study")


def study_folders(study: Study, folder: Path) -> Mapping[Path, Mapping[str, Any]]:
    """Return the run folders of a study, and for each its environment, algorithm and seed."""
    seeds = range(study.seeds) if isinstance(study.seeds, int) else study.seeds
    return {
        folder / environment.rpartition(":")[2] / f"{algorithm}_seed{seed}": {
            "environment": environment,
            "algorithm": algorithm,
            "seed": seed,
        }
        for environment in study.environments
        for algorithm in study.algorithms or [usual_algorithm(environment)]
        for seed in seeds
    }


def missing_trainings(study: Study, folder: Path) -> list[Job]:
    """Return a job for each run that is not complete. A run that was interrupted continues."""
    jobs, checked = [], set()
    for path, flags in study_folders(study, folder).items():
        environment = str(flags["environment"])
        config = resolve_config(environment, flags={**study.settings, **flags}, check_parts=True)
        run = Run.open(path) if is_run(path) else None
        if run is None or run.config != config or not (run.stopped or _steps(run) >= config.steps):
            if (config.environment, config.algorithm) not in checked:
                check_environment(config)
                checked.add((config.environment, config.algorithm))
            jobs.append(_named(training_job(config, path), path, folder))
    return jobs


def missing_evaluations(study: Study, folder: Path) -> list[Job]:
    """Return a job for each run whose final policy has not been evaluated in enough episodes."""
    jobs = []
    for path in study_folders(study, folder):
        run = Run.open(path)
        done = [(result["steps"], result["episodes"]) for result in run.evaluations() if is_as_trained(result)]
        if not any(
            steps >= (_steps(run) or run.config.steps) and episodes >= study.episodes for steps, episodes in done
        ):
            jobs.append(_named(evaluation_job(path, episodes=study.episodes), path, folder))
    return jobs


def run_jobs(
    jobs: list[Job], folder: Path, runner: Runner, on_progress: Callable[[int, Progress], None] | None = None
) -> Iterator[Outcome]:
    """Run the jobs of a study, and yield the outcome of each as soon as it has ended."""
    folder.mkdir(parents=True, exist_ok=True)
    yield from runner.run(jobs, folder.absolute(), on_progress)


def write_study(study: Study, folder: Path) -> tuple[Path, Comparison]:
    """Compare the runs of a study, write a page with its tables and pictures, and return the page and the comparison.

    Raises RunError if a run does not exist, or matplotlib is not installed.
    """
    found = compare([Run.open(path) for path in study_folders(study, folder)])
    plot_comparison(found, folder / "results.png")
    plot_comparison(found, folder / "results.pdf", size="page")
    for ending in (".csv", ".tex"):
        write_table(found, folder / f"results{ending}")
    folders = study_folders(study, folder).values()
    sizes = {name: len({each[name] for each in folders}) for name in ("environment", "algorithm", "seed")}
    parts = " × ".join(f"{count} {name}{'s' if count > 1 else ''}" for name, count in sizes.items())
    settings = "".join(f"\n- `{key}`: `{to_json(value)}`" for key, value in study.settings.items())
    lines = [
        f"# {folder.name}\n",
        f"{len(folders)} runs: {parts}, each evaluated in {study.episodes:,} new episodes. Written by `frobs study` on "
        f"{date.today():%d %B %Y}.\n",
        *([f"Settings that differ from the tuned ones:{settings}\n"] if settings else []),
        "![Learning curves and results](results.png)\n",
        "For papers: [results.pdf](results.pdf), [results.tex](results.tex), [results.csv](results.csv).\n\n## Groups\n",
        markdown_table(groups_table(found)),
        "## Runs\n",
        markdown_table(runs_table(found)),
        *(["## Notes\n", "\n".join(f"- {note}" for note in found.notes) + "\n"] if found.notes else []),
    ]
    page = folder / PAGE
    write_aside(page, lambda aside: aside.write_text("\n".join(lines), "utf-8"))
    return page, found


def _steps(run: Run) -> int:
    return max((each.steps for each in run.checkpoints), default=0)


def _named(job: Job, path: Path, folder: Path) -> Job:
    return replace(job, name=str(path.relative_to(folder)))
