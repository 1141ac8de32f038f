"""``frobs evaluate``: measure the performance of a policy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.facts import print_facts
from frobs_cli.formats import number, percent
from frobs_cli.options import CheckpointName, Json, LongestEpisode, Randomized, Seed, Simulator
from frobs_cli.output import only_json, print_json, working
from frobs_core.util.errors import CommandLineError
from frobs_train.cli.opened import (
    ModelAlgorithm,
    ModelPath,
    ModelSettings,
    Pretrained,
    RunsOrIds,
    Trust,
    UsesExpert,
    open_run,
)
from frobs_train.cli.runner_options import JobCpus, JobMemory, RayAddress, RunnerName, open_runner

if TYPE_CHECKING:
    from frobs_train import Evaluation
    from frobs_train.runners.jobs import PolicyKind


def evaluate(
    runs: RunsOrIds,
    pretrained: Pretrained = False,
    expert: UsesExpert = False,
    model: ModelPath = None,
    algorithm: ModelAlgorithm = None,
    settings: ModelSettings = None,
    trust: Trust = False,
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes to run.")] = 1000,
    simulator: Simulator = None,
    randomized: Randomized = False,
    seed: Seed = None,
    checkpoint: CheckpointName = "newest",
    longest_episode: LongestEpisode = None,
    runner: RunnerName = "local",
    ray_address: RayAddress = None,
    cpus: JobCpus = None,
    memory: JobMemory = None,
    json: Json = False,
) -> None:
    """Measure the performance of a policy on episodes that were never used in training.

    Use the policy of a run, a bundle or a model file, or the trained policy or scripted expert of an environment ID.
    Several policies are evaluated as separate jobs. If a job fails, the results of the other jobs are still printed,
    and the exit status is 1.

    Example:
        $ frobs evaluate runs/first
        $ frobs evaluate reach.frobs
        $ frobs evaluate frobs/Irb120Reach-v0 --pretrained
        $ frobs evaluate frobs/PandaPush-v0 --expert --episodes 200
        $ frobs evaluate runs/first --simulator pybullet
        $ frobs evaluate runs/first --randomized
        $ frobs evaluate frobs/Irb120Reach-v0 --model trained_model.zip
        $ frobs evaluate runs/first --checkpoint best --episodes 200 --json
        $ frobs evaluate runs/frobs/*/* --runner ray
    """
    from frobs_train import evaluate as evaluate_run
    from frobs_train.cli.evaluate_runs import evaluate_and_report
    from frobs_train.runners.jobs import evaluation_job
    from frobs_train.runners.runner import LOCAL

    chosen = open_runner(runner, ray_address, cpus, memory)
    if len(runs) > 1 or runner != LOCAL:
        if model is not None:
            raise CommandLineError(
                "--model", "this option requires a single RUN, and cannot be combined with --runner."
            )
        with only_json(json):
            for each in runs:
                open_run(each, model, algorithm, settings, trust, pretrained, expert)
        source: PolicyKind = "pretrained" if pretrained else "expert" if expert else "run"
        jobs = [
            evaluation_job(
                each,
                source,
                settings=settings or (),
                trust=trust,
                episodes=episodes,
                simulator=simulator,
                randomize=randomized,
                seed=seed,
                checkpoint=checkpoint,
                longest_episode=longest_episode,
            )
            for each in dict.fromkeys(runs)
        ]
        evaluate_and_report(jobs, chosen, json=json)
        return
    [run] = runs
    with only_json(json):
        opened = open_run(run, model, algorithm, settings, trust, pretrained, expert)
        with working("evaluating") as show:
            found = evaluate_run(
                opened,
                episodes,
                simulator=simulator,
                randomize=randomized,
                seed=seed,
                checkpoint=checkpoint,
                longest_episode=longest_episode,
                on_progress=lambda done: show(f"evaluating: {done:,} of {episodes:,} episodes"),
            )
    if json:
        print_json({"run" if model is None else "model": model or opened.path, **found.to_dict()})
    else:
        kinds = {"trained policy": pretrained, "expert": expert, "model file": model is not None}
        kind = next((name for name, given in kinds.items() if given), "run")
        print_facts({"name": str(run if pretrained else model or opened.path), "kind": kind, **summary(found)})


def summary(found: Evaluation) -> dict[str, object]:
    """Return a human-readable summary of an evaluation."""
    facts: dict[str, object] = {"environment": found.environment, "simulator": found.simulator}
    if found.randomize:
        facts["randomized"] = ", ".join(found.randomize)
    if found.success_rate is not None and found.success_interval is not None:
        low, high = found.success_interval
        facts["success"] = f"{percent(found.success_rate)}  (95 % interval: {percent(low)} to {percent(high)})"
    if found.success_by_octant:
        name, worst = min(found.success_by_octant.items(), key=lambda item: item[1].success_rate)
        facts["worst_octant"] = f"{percent(worst.success_rate)}  ({name}: {worst.episodes:,} episodes)"
    if found.tracking_error is not None:
        facts["tracking_error"] = f"{1e3 * found.tracking_error:.1f} mm on average over the second half of each episode"
    facts["reward"] = f"{number(found.mean_reward)} per episode"
    facts["length"] = f"{number(found.mean_length)} steps per episode"
    facts["episodes"] = f"{found.episodes:,}" + (f", after {found.steps:,} steps of training" if found.steps else "")
    return facts
