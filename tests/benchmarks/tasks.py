"""Measure how well each ID with tuned settings is learned: ``docs/explanation/tasks-measured.md``.

Trains three seeds of each, or five for policies that learn a manipulation task from its expert, evaluates them on MuJoCo
and on PyBullet, and compares the worst with FRobs_RL's own logs. If several algorithms are tuned for an ID, the table
contains the one with the highest success, and the section of the ID also lists the others. The runs stay in ``build/benchmarks/tasks``, and the results in ``tasks_measured.json`` next to this script. An
interrupted measurement continues where it stopped, also on another machine::

    python tests/benchmarks/tasks.py
    python tests/benchmarks/tasks.py --only frobs/Irb120Reach-v0 --seeds 0
    python tests/benchmarks/tasks.py --only frobs/PandaPush-v0 --algorithm sbx_ppo
    python tests/benchmarks/tasks.py --kept
    python tests/benchmarks/tasks.py --runner ray

With ``--runner``, all seeds are trained and evaluated as jobs in parallel. Their times do not count toward the target.
Each row contains the commit of its measurement, and a fingerprint of the files that define it; the page marks rows
whose files have changed since. ``--fresh`` discards runs and results. ``--kept`` trains nothing, and
writes the page from the existing results; the page then lists missing ones.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias, cast

import yaml
from common import ROOT, current_commit, frobs, is_shared, machine, manipulation_ids, slug
from fingerprints import IMITATION, add_fingerprints, defining_files, fingerprint, footnotes, mark

from frobs_core import plugins
from frobs_core.contracts import GoalTask
from frobs_core.plugins import registry
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.plain import plain
from frobs_train import Progress, Run, plot_runs, resolve_config
from frobs_train.cli.jobs_progress import collect_outcomes
from frobs_train.runners.jobs import evaluation_job, training_job
from frobs_train.runners.runner import LOCAL, Job, Outcome, Runner, RunnerOptions, load_runner, raise_failures

PAGE = ROOT / "docs" / "explanation" / "tasks-measured.md"
PICTURES = ROOT / "docs" / "images" / "tasks"
KEPT = ROOT / "build" / "benchmarks" / "tasks"
RECORD = Path(__file__).with_name("tasks_measured.json")
LOGS = Path(__file__).with_name("frobs_rl_logs.yaml")
TARGETS = Path(__file__).with_name("task_targets.yaml")
SEEDS, EPISODES = (0, 1, 2), 1000
MORE_SEEDS = (0, 1, 2, 3, 4)
"""Seeds of ``dagger`` in manipulation tasks that are not goal-conditioned."""
OTHER_SIMULATOR, OTHER_EPISODES = "pybullet", 250
"""The second simulator of the evaluation, and its number of episodes. It steps one environment at a time."""
MOST_STEPS, OTHER_MOST_STEPS = 500_000, 100_000
"""Maximum number of environment steps per evaluation; if episodes may be long, there are fewer of them."""
KEPT_SHARE = 0.95
"""Minimum ratio of the success on the other simulator; below it, the parity certificate gives the reason."""
LONGEST = 30 * 60
"""Maximum duration of a training run [s]."""


@dataclass(frozen=True)
class Case:
    """A training run: an ID with an algorithm and a controller.

    Attributes:
        id: Gymnasium ID.
        algorithm: Name of the algorithm.
        controller: Name of the controller; empty: the ID's default.
    """

    id: str
    algorithm: str
    controller: str = ""

    @property
    def slug(self) -> str:
        """Name for files."""
        return "-".join(filter(None, (slug(self.id), self.controller)))

    def folder(self, seed: int, kept: Path) -> Path:
        """Folder of a seed."""
        return kept / f"{self.slug}-{self.algorithm}-seed{seed}"

    @property
    def fingerprint(self) -> dict[str, str]:
        """Hashes of the files that define the training run."""
        return fingerprint(self.id, self.algorithm, self.controller)

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds to measure."""
        goal = issubclass(registry.environments()[self.id][0].load(), GoalTask)
        more = self.algorithm == "dagger" and self.id in manipulation_ids() and not goal
        return MORE_SEEDS if more else SEEDS


Rows: TypeAlias = Mapping[Case, Sequence[Mapping[str, Any]]]
"""Results of :func:`measure` for each case, one per seed."""


def tuned_cases() -> list[Case]:
    """Return each ID that has a robot with each algorithm that is tuned for it.

    The first algorithm of an ID is ``dagger`` if it is tuned for the ID, otherwise the one of ``task_targets.yaml``, PPO
    if none is given there, or the first by name.
    """
    records, targets = cast("Mapping[str, AlgorithmRecord]", plugins.records("algorithm")), _yaml(TARGETS)
    found = []
    for id, (_, environment) in registry.environments().items():
        tuned = sorted(name for name, record in records.items() if id in record.tuned)
        order = ["dagger", targets.get(id, {}).get("algorithm", "ppo"), *tuned]
        if environment.robot:
            found += [Case(id, name) for name in sorted(tuned, key=order.index)]
    return found


def cases(record: Path = RECORD) -> list[Case]:
    """Return one case per ID: its first algorithm, or if that one is recorded, the one with the highest success."""
    tuned = tuned_cases()
    first = {case.id: case for case in reversed(tuned)}
    best = {case.id: case for case in best_rows({case: recorded_seeds(case, record) for case in tuned})}
    return [best[id] if recorded_seeds(case, record) else case for id, case in reversed(first.items())]


def best_rows(rows: Rows) -> Rows:
    """Return the results of one case per ID: the one with the highest median success, or the first of them."""
    best: dict[str, Case] = {}
    for case, found in rows.items():
        if found and (case.id not in best or _median_success(found) > _median_success(rows[best[case.id]])):
            best[case.id] = case
    return {case: rows[case] for case in best.values()}


def measure(
    case: Case,
    seed: int,
    episodes: int = EPISODES,
    steps: int | None = None,
    kept: Path = KEPT,
    other_simulator: str | None = OTHER_SIMULATOR,
    shared: bool = False,
) -> dict[str, Any]:
    """Train a seed and evaluate it in separate processes, or return the existing results.

    Args:
        case: Training run.
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        steps: Number of training steps; None: the tuned number.
        kept: Folder of finished seeds.
        other_simulator: Second simulator of the evaluation; None: only the first one.
        shared: Whether other programs or virtual machines slow this machine.

    Returns:
        ``id``, ``algorithm``, ``seed``, ``run`` (the folder), ``steps``, ``seconds`` of training, ``in_training`` (the
        success of its last 100 episodes), ``machine``, ``shared`` (whether other programs slowed it), ``commit``,
        ``files`` (the fingerprint of what defines it), and the results of ``frobs evaluate`` under ``mujoco`` and ``pybullet`` (None: not installed).
    """
    folder = case.folder(seed, kept)
    result = folder / "result.json"
    if result.is_file():
        return cast("dict[str, Any]", json.loads(result.read_text("utf-8")))
    run, done = folder / "run", folder / "trained.json"
    if done.is_file():
        trained = json.loads(done.read_text("utf-8"))
    else:
        source = {"commit": current_commit(), "files": case.fingerprint}
        budget = () if steps is None else ("--steps", steps)
        flags = ["--algorithm", case.algorithm, "--seed", seed, "--on-existing", "resume"]
        if case.controller:
            flags += ["--controller", case.controller]
        trained = {**frobs("train", case.id, *flags, "--run-dir", run, *budget), **source}
        done.write_text(json.dumps(trained, indent=1), "utf-8")
    found = frobs("evaluate", run, "--episodes", evaluation_episodes(case, episodes))
    other = None
    if other_simulator and find_spec(other_simulator) is not None:
        fewer = evaluation_episodes(case, episodes, other=True)
        other = frobs("evaluate", run, "--episodes", fewer, "--simulator", other_simulator)
    return write_row(case, seed, kept, trained, found, other, machine=machine(), shared=shared or is_shared())


def evaluation_episodes(case: Case, episodes: int, *, other: bool = False) -> int:
    """Return the number of episodes of an evaluation: fewer for long episodes, or on the other simulator."""
    longest = registry.environments()[case.id][1].max_episode_steps
    return min(episodes, OTHER_EPISODES, OTHER_MOST_STEPS // longest) if other else min(episodes, MOST_STEPS // longest)


def write_row(
    case: Case,
    seed: int,
    kept: Path,
    trained: Mapping[str, Any],
    found: Mapping[str, Any],
    other: Mapping[str, Any] | None,
    *,
    machine: str,
    shared: bool,
) -> dict[str, Any]:
    """Write the results of a seed to its folder, and return them in the format of :func:`measure`."""
    folder = case.folder(seed, kept)
    row = {
        "id": case.id,
        "algorithm": case.algorithm,
        "seed": seed,
        "run": str((folder / "run").relative_to(kept)),
        "steps": trained["steps"],
        "seconds": trained["seconds"],
        "in_training": trained.get("success"),
        "machine": machine,
        "shared": shared,
        "commit": trained["commit"],
        **({"files": trained["files"]} if "files" in trained else {}),
        "mujoco": without_run(found),
        "pybullet": without_run(other),
    }
    (folder / "result.json").write_text(json.dumps(plain(row), indent=1), "utf-8")
    rate = found["success_rate"]
    name = " ".join(filter(None, (case.id, case.algorithm, case.controller)))
    sys.stderr.write(f"{name}, seed {seed}: {rate:.1%} after {trained['seconds']:.0f} s\n")
    return row


def without_run(found: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return the results of an evaluation without the run's folder, which is one of this machine."""
    return None if found is None else {key: value for key, value in found.items() if key != "run"}


def measure_as_jobs(
    runner: Runner,
    wanted: Sequence[tuple[Case, int]],
    episodes: int = EPISODES,
    steps: int | None = None,
    kept: Path = KEPT,
    other_simulator: str | None = OTHER_SIMULATOR,
) -> None:
    """Train and evaluate seeds as jobs of a runner, so that :func:`measure` finds their results.

    Args:
        runner: Runner of the jobs.
        wanted: Cases and seeds; finished ones are not repeated.
        episodes: Number of episodes per evaluation.
        steps: Number of steps per training run; None: the tuned number.
        kept: Folder of finished seeds.
        other_simulator: Second simulator of the evaluation; None: only the first one.

    Raises:
        JobsError: Some jobs failed; all others are complete.
    """
    kept.mkdir(parents=True, exist_ok=True)
    missing = [each for each in wanted if not (each[0].folder(each[1], kept) / "result.json").is_file()]
    commit = current_commit()
    untrained, jobs, sources = [], [], []
    for case, seed in missing:
        folder = case.folder(seed, kept)
        if not (folder / "trained.json").is_file():
            flags = {"algorithm": case.algorithm, "controller": case.controller or None, "seed": seed, "steps": steps}
            untrained.append(folder)
            sources.append({"commit": commit, "files": case.fingerprint})
            jobs.append(replace(training_job(resolve_config(case.id, flags=flags), folder / "run"), name=folder.name))

    def keep_training(outcome: Outcome) -> None:
        facts = {**outcome.result, "steps": int(outcome.result["steps"]), **sources[outcome.index]}
        (untrained[outcome.index] / "trained.json").write_text(json.dumps(plain(facts), indent=1), "utf-8")

    outcomes = run_jobs(runner, jobs, kept, keep_training)
    trained = [each for each in missing if (each[0].folder(each[1], kept) / "trained.json").is_file()]
    simulators = [None, other_simulator] if other_simulator and find_spec(other_simulator) is not None else [None]
    tasks = [(case, seed, simulator) for case, seed in trained for simulator in simulators]
    evaluations = []
    for case, seed, simulator in tasks:
        folder, fewer = case.folder(seed, kept), evaluation_episodes(case, episodes, other=simulator is not None)
        job = evaluation_job(folder / "run", episodes=fewer, simulator=simulator)
        evaluations.append(replace(job, name=" on ".join(filter(None, (folder.name, simulator)))))
    found: dict[tuple[Case, int], dict[str | None, Any]] = {}

    def keep_evaluation(outcome: Outcome) -> None:
        case, seed, simulator = tasks[outcome.index]
        results = found.setdefault((case, seed), {})
        results[simulator] = outcome.result
        if len(results) == len(simulators):
            facts = json.loads((case.folder(seed, kept) / "trained.json").read_text("utf-8"))
            where = f"{machine()}, --runner {runner.name}"
            other = results.get(other_simulator)
            write_row(case, seed, kept, facts, results[None], other, machine=where, shared=True)

    outcomes += run_jobs(runner, evaluations, kept, keep_evaluation)
    raise_failures(outcomes)


def run_jobs(runner: Runner, jobs: Sequence[Job], folder: Path, keep: Callable[[Outcome], None]) -> list[Outcome]:
    """Run jobs, show their progress, and pass on each result as soon as it is available."""

    def start(on_progress: Callable[[int, Progress], None]) -> Iterator[Outcome]:
        for outcome in runner.run(jobs, folder.absolute(), on_progress):
            if outcome.error is None:
                keep(outcome)
            yield outcome

    again = "repeat the command to continue"
    return collect_outcomes([job.name for job in jobs], start, again) if jobs else []


def kept_row(case: Case, seed: int, kept: Path = KEPT) -> dict[str, Any] | None:
    """Return the results of a seed on this machine, or None."""
    return measure(case, seed, kept=kept) if (case.folder(seed, kept) / "result.json").is_file() else None


def recorded_seeds(case: Case, record: Path = RECORD) -> list[dict[str, Any]]:
    """Return the results of all seeds on any machine."""
    rows = json.loads(record.read_text("utf-8")) if record.is_file() else []
    return [row for row in rows if (row["id"], row["algorithm"]) == (case.id, case.algorithm)]


def recorded(case: Case, seed: int, record: Path = RECORD) -> dict[str, Any] | None:
    """Return the results of a seed on any machine, or None."""
    return next((row for row in recorded_seeds(case, record) if row["seed"] == seed), None)


def explain_drop(case: Case, kept: Path = KEPT) -> str:
    """Return the deviations above tolerance between the two simulators in the parity certificate."""
    folder = kept / f"{case.slug}-parity"
    if not (folder / "certificate.json").is_file():
        names = f"mujoco,{OTHER_SIMULATOR}"
        command = [sys.executable, "-m", "frobs_cli", "parity", case.id, "--simulators", names, "--out", folder]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=False)  # status 1: a deviation is above its tolerance
    if not (folder / "certificate.json").is_file():
        return "no certificate could be made"
    certificate = json.loads((folder / "certificate.json").read_text("utf-8"))
    failed = [m["title"].lower() for m in certificate["measurements"] if m["status"] == "failed"]
    return f"`frobs parity`: {certificate['verdict']}" + (
        f"; over the tolerance: {', '.join(failed)}" if failed else ""
    )


def report(rows: Rows, drops: Mapping[str, str], episodes: int) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`measure`, one per seed, also of algorithms that are not the best for their ID.
        drops: Reason for the lower success on the other simulator, by ID.
        episodes: Number of episodes per evaluation.
    """
    targets, logs = _yaml(TARGETS), _yaml(LOGS)
    shown = best_rows(rows)
    machines = sorted({row["machine"] for found in rows.values() for row in found})
    lines = [
        "# Benchmarks: tasks",
        "",
        f"Measured by `tests/benchmarks/tasks.py` on {date.today():%d %B %Y}. Machines: {'; '.join(machines)}. Each seed was trained with "
        "the settings that are tuned for the ID (`frobs train ID --algorithm NAME --seed S`). `frobs evaluate` then measured the "
        f"deterministic policy in {episodes:,} new episodes on MuJoCo and {OTHER_EPISODES} on PyBullet. Where these episodes could "
        f"have taken more than {MOST_STEPS:,} steps on MuJoCo or {OTHER_MOST_STEPS:,} on PyBullet, fewer episodes were used. The table "
        "shows the result of the worst seed with its 95 % confidence interval. The training time is that of the slowest seed on an "
        "idle machine, if there is one, and includes writing checkpoints. If several algorithms were measured, the table shows the one "
        "with the highest median success. *From a scripted expert that sees the state* means that the policy imitates the task's "
        "script, which reads the positions of all objects from the simulation. All other policies learn from rewards, and "
        "the settings of some let training episodes begin on the path of that expert (`reset_from`).",
        "",
        "| ID | way | seeds | steps | training | worst success | 95 % interval | median | steps to success | tracking error | "
        "wanted | on PyBullet, worst | in training, worst | FRobs_RL, in training |",
        "|---|---|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|---|",
    ]
    lines += [_summary(case, found, targets.get(case.id, {}), logs["runs"]) for case, found in shown.items()]
    others = rows.keys() - shown.keys()
    lines += footnotes(
        {
            f"`{case.id}`" + (f" with `{case.algorithm}`" if case in others else ""): (found, case.fingerprint)
            for case, found in rows.items()
        }
    )
    lines += [
        "",
        f"{logs['about']} The *in training* column shows FRobs's success rate over the last 100 training episodes, with exploration, "
        "which can be compared with FRobs_RL's figures. The other columns were measured without exploration. The tracking error "
        "is the mean distance from the tool to the goal over the second half of each episode, for the worst seed. The steps to success "
        "are the control steps that successful episodes took until the task was solved and stayed solved: the mean over the "
        "episodes, and the median over the seeds. A training run should take at most "
        f"{LONGEST // 60} minutes.",
    ]
    if missing := sorted({case.id for case in cases()} - {case.id for case in rows}):
        lines += ["", f"These IDs are tuned but not measured yet: {', '.join(f'`{id}`' for id in missing)}."]
    for case, found in shown.items():
        lines += ["", f"## {case.id}", ""]
        if case.id in drops:
            lines += [
                f"On PyBullet, the success is less than {KEPT_SHARE:.0%} of that on MuJoCo. {drops[case.id]}.",
                "",
            ]
        lines += _seeds(found)
        lines += [_other(other, rows[other]) for other in rows if other.id == case.id and other != case]
        if (PICTURES / f"{case.slug}.png").is_file():
            picture = f"../images/tasks/{case.slug}.png"
            lines += ["", f"![Learning curves of {case.id}: success rate and reward during training]({picture})"]
    return "\n".join(lines) + "\n"


def _summary(
    case: Case, found: Sequence[Mapping[str, Any]], target: Mapping[str, float], logs: Sequence[Mapping[str, Any]]
) -> str:
    worst = min(found, key=lambda row: row["mujoco"]["success_rate"])["mujoco"]
    errors = [row["mujoco"]["tracking_error"] for row in found if row["mujoco"].get("tracking_error") is not None]
    others = [row["pybullet"]["success_rate"] for row in found if row["pybullet"]]
    explored = [row["in_training"] for row in found if row.get("in_training") is not None]
    idle = [row for row in found if not row.get("shared")]
    slowest = max(idle or found, key=lambda row: row["seconds"])
    missed = any(row["seconds"] > LONGEST for row in idle)
    wanted = []
    if "success" in target:
        wanted.append(f"≥ {target['success']:.0%}")
        missed |= worst["success_rate"] < target["success"]
    if "tracking_error" in target:
        wanted.append(f"≤ {100 * target['tracking_error']:.0f} cm")
        missed |= not errors or max(errors) > target["tracking_error"]
    cells = [
        f"[`{case.id}`](#{case.id.lower().replace('/', '')}) {mark(found, case.fingerprint)}".rstrip(),
        _way(case),
        f"{len(found)}",
        f"{found[0]['steps']:,}",
        _time(slowest),
        f"{worst['success_rate']:.1%}",
        "{:.1%} to {:.1%}".format(*worst["success_interval"]),
        f"{_median_success(found):.1%}",
        _steps_to_success(found),
        f"{100 * max(errors):.1f} cm" if errors else "–",
        (", ".join(wanted) or "–") + (" (missed)" if missed else ""),
        f"{min(others):.1%}" if others else "–",
        f"{min(explored):.0%}" if explored else "–",
        "; ".join(_log(log) for log in logs if case.id in log["ids"]) or "–",
    ]
    return f"| {' | '.join(cells)} |"


def _way(case: Case) -> str:
    return f"`{case.algorithm}`" + (
        ", from a scripted expert that sees the state" if case.algorithm in IMITATION else ""
    )


def _median_success(found: Sequence[Mapping[str, Any]]) -> float:
    return median(row["mujoco"]["success_rate"] for row in found)


def _steps_to_success(found: Sequence[Mapping[str, Any]]) -> str:
    """Return the median over the seeds that measured it, which older versions did not."""
    steps = [row["mujoco"]["steps_to_success"] for row in found if row["mujoco"].get("steps_to_success") is not None]
    return f"{median(steps):.0f}" if steps else "–"


def _other(case: Case, found: Sequence[Mapping[str, Any]]) -> str:
    """Return a paragraph about an algorithm that the table does not show."""
    rates = [row["mujoco"]["success_rate"] for row in found]
    return (
        f"\nAlso measured: {f'{_way(case)} {mark(found, case.fingerprint)}'.rstrip()}. Success: {min(rates):.1%} to {max(rates):.1%}, median {_median_success(found):.1%}. "
        f"Seeds: {len(found)}. Steps to success: {_steps_to_success(found)}. "
        f"Training: {found[0]['steps']:,} steps in {_time(max(found, key=lambda row: row['seconds']))}."
    )


def _log(log: Mapping[str, Any]) -> str:
    said = f"return {log['return']:g}" if log.get("success") is None else f"{log['success']:.0%}"
    return f"{log['algorithm']}: {said} after {log['seconds'] / 3600:.0f} h"


def _seeds(found: Sequence[Mapping[str, Any]]) -> list[str]:
    lines = [
        "| seed | steps | training | success | 95 % interval | steps to success | reward | length | on PyBullet | commit |",
        "|---:|---:|---:|---:|---|---:|---:|---:|---:|---|",
    ]
    for row in found:
        ours, other = row["mujoco"], row["pybullet"]
        low, high = ours["success_interval"]
        lines.append(
            f"| {row['seed']} | {row['steps']:,} | {_time(row)} | {ours['success_rate']:.1%} | {low:.1%} to "
            f"{high:.1%} | {_steps_to_success([row])} | {ours['mean_reward']:.2f} | {ours['mean_length']:.0f} | "
            f"{format(other['success_rate'], '.1%') if other else '–'} | {row['commit']} |"
        )
    return lines


def draw(case: Case, found: Sequence[Mapping[str, Any]], kept: Path = KEPT) -> None:
    """Draw the learning curves of the seeds, if all of them are stored on this machine."""
    folders = [kept / row["run"] for row in found]
    if all(folder.is_dir() for folder in folders):
        PICTURES.mkdir(parents=True, exist_ok=True)
        plot_runs([Run.open(folder) for folder in folders], PICTURES / f"{case.slug}.png")


def dropped(found: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether the success of a seed is too low on the other simulator."""
    return any(
        row["pybullet"] and row["pybullet"]["success_rate"] < KEPT_SHARE * row["mujoco"]["success_rate"]
        for row in found
    )


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    known = {case.id: case for case in cases()}
    parser.add_argument(
        "--only", nargs="+", choices=sorted(known), metavar="ID", help="measure only these IDs; writes no page"
    )
    parser.add_argument(
        "--algorithm", metavar="NAME", help="algorithm tuned for the IDs; default: the best for each ID"
    )
    parser.add_argument("--seeds", nargs="+", type=int, help="default: 0 1 2, or 0 to 4 for dagger in manipulation")
    parser.add_argument("--episodes", type=int, default=EPISODES, help="episodes per evaluation")
    parser.add_argument("--fresh", action="store_true", help="discard existing runs and results")
    parser.add_argument("--kept", action="store_true", help="write the page from existing results")
    parser.add_argument(
        "--fingerprints",
        action="store_true",
        help="only add fingerprints to existing results that have none, from the commits at which they were measured",
    )
    parser.add_argument(
        "--shared",
        action="store_true",
        help="other virtual machines slow this one; times do not count toward the target",
    )
    add_runner_options(parser)
    given = parser.parse_args()
    if given.fingerprints:
        add_fingerprints(RECORD, lambda row: defining_files(row["id"], row["algorithm"]))
        return
    chosen = [with_algorithm(known[id], given.algorithm) for id in given.only or known]
    if untuned := [case.id for case in chosen if case not in tuned_cases()]:
        parser.error(f"--algorithm: {given.algorithm} is not tuned for {', '.join(untuned)}; choose --only")
    wanted = [(case, seed) for case in chosen for seed in given.seeds or case.seeds]
    if given.fresh:
        for case in chosen:
            for folder in (*KEPT.glob(f"{case.slug}-{case.algorithm}-*"), *KEPT.glob(f"{case.slug}-parity")):
                shutil.rmtree(folder)
    if given.runner != LOCAL and not given.kept:
        missing = [each for each in wanted if given.fresh or (kept_row(*each) is None and recorded(*each) is None)]
        measure_as_jobs(open_runner(given), missing, given.episodes)
    rows: dict[Case, list[dict[str, Any]]] = {}
    for case in chosen if given.only else tuned_cases():
        for seed in sorted({*case.seeds, *(given.seeds or ())}):
            is_wanted = (case, seed) in wanted
            row = kept_row(case, seed) or (None if given.fresh and is_wanted else recorded(case, seed))
            if row is None and is_wanted and not given.kept:
                row = measure(case, seed, given.episodes, shared=given.shared)
            if row is not None:
                rows.setdefault(case, []).append(row)
    shown = best_rows(rows)
    drops = {case.id: explain_drop(case) for case, found in shown.items() if dropped(found)}
    if not given.only:
        for case, found in shown.items():
            draw(case, found)
    page = report(rows, drops, given.episodes)
    if given.only:  # write no page of a part of the results
        sys.stdout.write(page)
    else:
        RECORD.write_text(json.dumps([row for found in rows.values() for row in found], indent=1) + "\n", "utf-8")
        PAGE.write_text(page, "utf-8")


def with_algorithm(case: Case, algorithm: str | None) -> Case:
    """Return a case with another algorithm, or the same case for None."""
    return replace(case, algorithm=algorithm or case.algorithm)


def add_runner_options(parser: ArgumentParser) -> None:
    """Add the options that choose a runner."""
    parser.add_argument("--runner", default=LOCAL, metavar="NAME", help="runner of the jobs, such as ray")
    parser.add_argument("--ray-address", metavar="ADDRESS", help="address of the Ray cluster to join")
    parser.add_argument("--cpus", type=int, metavar="N", help="processors per job")


def open_runner(given: Namespace) -> Runner:
    """Return the runner that the command line selects."""
    return load_runner(given.runner, RunnerOptions(address=given.ray_address, processors=given.cpus))


def _yaml(path: Path) -> dict[str, Any]:
    return cast("dict[str, Any]", yaml.safe_load(path.read_text("utf-8")))


def _time(row: Mapping[str, Any]) -> str:
    return _duration(row["seconds"]) + (" (shared machine)" if row.get("shared") else "")


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.1f} min"


if __name__ == "__main__":
    main()
