"""``frobs evaluate``: measure the performance of a policy."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from frobs_cli.errors import CommandLineError
from frobs_cli.facts import print_facts
from frobs_cli.formats import number, percent, settings_text
from frobs_cli.options import CheckpointName, Json, LongestEpisode, Randomized, Seed, Simulator
from frobs_cli.output import only_json, print_json, print_table, working
from frobs_train.cli.jobs_progress import collect_outcomes
from frobs_train.cli.opened import PolicyChoice, RunsOrIds
from frobs_train.cli.runner_options import RunnerChoice

if TYPE_CHECKING:
    from frobs_train import Evaluation
    from frobs_train.runners.runner import Job, Outcome, Runner


_KINDS = {"pretrained": "trained policy", "expert": "expert"}


def evaluate(
    runs: RunsOrIds,
    policy: PolicyChoice,
    runner: RunnerChoice,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes to run.")] = 1000,
    simulator: Simulator = None,
    randomized: Randomized = False,
    seed: Seed = None,
    checkpoint: CheckpointName = "newest",
    longest_episode: LongestEpisode = None,
    json: Json = False,
) -> None:
    """Measure the performance of a policy on episodes that were never used in training.

    Use the policy of a run or a bundle, or with --policy, any policy in an environment.
    Several policies are evaluated as separate jobs. If a job fails, the results of the other jobs are still printed,
    and the exit status is 1.

    Example:
        $ frobs evaluate runs/first
        $ frobs evaluate reach.frobs
        $ frobs evaluate frobs/Irb120Reach-v0 --policy pretrained
        $ frobs evaluate frobs/PandaPush-v0 --policy expert --episodes 200
        $ frobs evaluate runs/first --simulator pybullet
        $ frobs evaluate runs/first --randomized
        $ frobs evaluate frobs/Irb120Reach-v0 --policy trained_model.zip
        $ frobs evaluate runs/first --checkpoint best --episodes 200 --json
        $ frobs evaluate runs/frobs/*/* --runner ray
    """
    from frobs_train import evaluate as evaluate_run
    from frobs_train.runners.jobs import evaluation_job

    name, model = policy.name, policy.model
    chosen = runner.open()
    options: dict[str, Any] = {
        "simulator": simulator,
        "randomize": randomized,
        "seed": seed,
        "checkpoint": checkpoint,
        "longest_episode": longest_episode,
    }
    if len(runs) > 1 or not runner.is_local:
        if model is not None:
            raise CommandLineError(
                "--model", "this option requires a single RUN, and cannot be combined with --runner."
            )
        with only_json(json):
            for each in runs:
                policy.open(each)
        jobs = [
            evaluation_job(each, name, settings=policy.settings or (), trust=policy.trust, episodes=episodes, **options)
            for each in dict.fromkeys(runs)
        ]
        evaluate_and_report(jobs, chosen, json=json)
        return
    [run] = runs
    with only_json(json):
        opened = policy.open(run)
        with working("evaluating") as show:
            result = evaluate_run(
                opened,
                episodes,
                on_progress=lambda done: show(f"evaluating: {done:,} of {episodes:,} episodes"),
                **options,
            )
    if json:
        print_json({"run" if model is None else "model": model or opened.path, **result.to_dict()})
    else:
        kind = "model file" if model else _KINDS.get(name or "", f"policy {name}" if name else "run")
        print_facts({"name": str(model or (run if name else opened.path)), "kind": kind, **summary(result)})


def summary(found: Evaluation) -> dict[str, object]:
    """Return a human-readable summary of an evaluation."""
    facts: dict[str, object] = {"environment": found.environment, "simulator": found.simulator}
    facts["simulator_kwargs"] = settings_text(found.simulator_kwargs)
    if found.randomize:
        facts["randomized"] = ", ".join(found.randomize)
    if found.success_rate is not None and found.success_interval is not None:
        low, high = found.success_interval
        facts["success"] = f"{percent(found.success_rate)}  (95 % interval: {percent(low)} to {percent(high)})"
    if found.steps_to_success is not None:
        facts["steps_to_success"] = f"{number(found.steps_to_success)} on average in successful episodes"
    if found.success_by_octant:
        name, worst = min(found.success_by_octant.items(), key=lambda item: item[1].success_rate)
        facts["worst_octant"] = f"{percent(worst.success_rate)}  ({name}: {worst.episodes:,} episodes)"
    if found.tracking_error is not None:
        facts["tracking_error"] = f"{1e3 * found.tracking_error:.1f} mm on average over the second half of each episode"
    facts["reward"] = f"{number(found.mean_reward)} per episode"
    facts["length"] = f"{number(found.mean_length)} steps per episode"
    facts["episodes"] = f"{found.episodes:,}" + (f", after {found.steps:,} steps of training" if found.steps else "")
    return facts


def evaluate_and_report(jobs: Sequence[Job], runner: Runner, *, json: bool) -> None:
    """Run evaluation jobs, and print a table with one row per policy."""
    from frobs_train.runners.runner import raise_failures

    with only_json(json):
        outcomes = run_evaluations(jobs, runner)
    results = {outcome.job.name: outcome.result for outcome in outcomes if outcome.error is None}
    if json:
        print_json(list(results.values()))
    elif results:
        rows = [_row_of_run(name, result) for name, result in results.items()]
        print_table(["environment", "run", "success", "95 % interval", "reward", "episodes"], rows)
    raise_failures(outcomes)


def run_evaluations(jobs: Sequence[Job], runner: Runner) -> list[Outcome]:
    """Run evaluation jobs, show their progress, and return their outcomes in job order."""
    runs = [run.parent for job in jobs if isinstance(run := job.arguments["run"], Path)]
    folder = Path(os.path.commonpath(runs)) if runs else Path.cwd()
    return collect_outcomes(
        [job.name for job in jobs],
        lambda update: runner.run(jobs, folder, update),
        "the results of the finished evaluations are in the run folders",
    )


def _row_of_run(name: str, found: Mapping[str, Any]) -> list[str]:
    interval = found["success_interval"]
    return [
        found["environment"],
        name,
        percent(found["success_rate"]),
        "–" if interval is None else f"{percent(interval[0])} to {percent(interval[1])}",
        number(found["mean_reward"]),
        f"{found['episodes']:,}",
    ]
