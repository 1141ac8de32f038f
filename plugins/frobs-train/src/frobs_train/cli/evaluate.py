"""``frobs evaluate``: measure what a run has learned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from frobs_cli.facts import print_facts
from frobs_cli.formats import number, percent
from frobs_cli.options import CheckpointName, Json, Randomized, Seed, Simulator
from frobs_cli.output import console, only_json, print_json
from frobs_train.cli.opened import (
    ModelAlgorithm,
    ModelPath,
    ModelSettings,
    Pretrained,
    RunOrId,
    Trust,
    UsesExpert,
    open_run,
)

if TYPE_CHECKING:
    from frobs_train import Evaluation


def evaluate(
    run: RunOrId,
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
    json: Json = False,
) -> None:
    """Measure the performance of a policy on episodes that were never used in training.

    The policy is that of a run, a bundle, a trained policy of an ID, a model file or an expert.

    Example:
        $ frobs evaluate runs/first
        $ frobs evaluate reach.frobs
        $ frobs evaluate frobs/Irb120Reach-v0 --pretrained
        $ frobs evaluate frobs/PandaPush-v0 --expert --episodes 200
        $ frobs evaluate runs/first --simulator pybullet
        $ frobs evaluate runs/first --randomized
        $ frobs evaluate frobs/Irb120Reach-v0 --model trained_model.zip
        $ frobs evaluate runs/first --checkpoint best --episodes 200 --json
    """
    from frobs_train import evaluate as evaluate_run

    with only_json(json):
        opened = open_run(run, model, algorithm, settings, trust, pretrained, expert)
        with console(stderr=True).status(f"running {episodes:,} episodes"):
            found = evaluate_run(
                opened, episodes, simulator=simulator, randomize=randomized, seed=seed, checkpoint=checkpoint
            )
    if json:
        print_json({"run" if model is None else "model": model or opened.path, **found.to_dict()})
    else:
        kinds = {"trained policy": pretrained, "expert": expert, "model file": model is not None}
        kind = next((name for name, given in kinds.items() if given), "run")
        print_facts({"name": str(run if pretrained else model or opened.path), "kind": kind, **summary(found)})


def summary(found: Evaluation) -> dict[str, object]:
    """Return an evaluation as people read it."""
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
        facts["tracking_error"] = f"{1e3 * found.tracking_error:.1f} mm on average, in the second half of the episodes"
    facts["reward"] = f"{number(found.mean_reward)} per episode"
    facts["length"] = f"{number(found.mean_length)} steps per episode"
    facts["episodes"] = f"{found.episodes:,}" + (f", after {found.steps:,} steps of training" if found.steps else "")
    return facts
