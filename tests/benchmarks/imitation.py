"""Measure what demonstrations are good for: ``docs/explanation/imitation-measured.md``.

Policies imitate recorded episodes of the scripted expert and of a policy that acts like a person (``person.py``),
reinforcement learning uses demonstrations, and PPO improves a policy that imitates the expert. Every command is one that
a user can enter. The results are stored in ``results/imitation``, so an interrupted measurement continues with the first
one that is missing. ``--fresh`` discards them::

    python tests/benchmarks/imitation.py
    python tests/benchmarks/imitation.py --only recorded-person-20 --seeds 0
    python tests/benchmarks/imitation.py --kept

Requires an idle machine, and takes many hours: a seed takes minutes for recorded demonstrations, and up to an hour for
reinforcement learning.
"""

from __future__ import annotations

import shutil
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any, TypeAlias

sys.path.insert(0, str(Path(__file__).parent))

from common import RESULTS, ROOT, frobs, is_shared, stored

from frobs_train.logs.progress import STEPS, read_progress

PAGE = ROOT / "docs" / "explanation" / "imitation-measured.md"
KEPT = RESULTS / "imitation"
BUILD = ROOT / "build" / "benchmarks" / "imitation"
PICK, PUSH = "frobs/PandaPickAndPlace-v0", "frobs/PandaPush-v0"
SEEDS, EPISODES, FEWER_EPISODES = (0, 1, 2, 3, 4), 1000, 200
"""Seeds, number of episodes per evaluation of a policy, and of an evaluation of whoever demonstrates."""
SUCCESS, MOST_STEPS = 0.9, 300_000
"""Success rate that SAC must reach in an evaluation during training, and maximum number of environment steps."""
SAC = (
    "num_envs=16",
    f"steps={MOST_STEPS}",
    "evaluate_every=10_000",
    f"stop_at_success={SUCCESS}",
    "algorithm_config.learning_starts=2_000",
    "algorithm_config.gradient_steps=8",
    "algorithm_config.gamma=0.97",
    "algorithm_config.ent_coef=auto_0.05",
    "algorithm_config.normalize_observation=true",
)
"""Settings of SAC, with and without demonstrations."""
PPO = ("steps=2_000_000", "algorithm_config.policy_kwargs.log_std_init=-2.0")
"""Settings of PPO that differ from those tuned for pushing: the imitating policy needs less exploration and time."""
RESULT = ("success_rate", "success_interval", "steps_to_success")
"""Values of an evaluation that are stored."""


def outcome(*arguments: object, episodes: int = EPISODES, path: Path | None = None) -> dict[str, Any]:
    """Evaluate a policy in new episodes, and return the values in :data:`RESULT`."""
    found = frobs("evaluate", *arguments, "--episodes", episodes, path=path)
    return {key: found[key] for key in RESULT}


def train(id: str, algorithm: str, seed: int, run: Path, settings: Sequence[str]) -> float:
    """Train a policy and return the duration of the command [s]."""
    words = [word for each in settings for word in ("--set", each)]
    begin = perf_counter()
    frobs("train", id, "--algorithm", algorithm, "--seed", seed, "--run-dir", run, *words)
    return perf_counter() - begin


def install_person(folder: Path) -> Path:
    """Write a distribution with the plugin of ``person.py`` into a folder, and return the folder."""
    info = folder / "frobs_benchmark_person-1.0.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    shutil.copy(Path(__file__).with_name("person.py"), folder)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: frobs-benchmark-person\nVersion: 1.0\n", "utf-8")
    (info / "entry_points.txt").write_text("[frobs]\nperson = person\n", "utf-8")
    return folder


def measure_recorded(policy: str, episodes: int, algorithm: str, seed: int, folder: Path) -> dict[str, Any]:
    """Record episodes of a policy, and imitate them.

    Args:
        policy: Name of the policy that demonstrates.
        episodes: Number of recorded episodes, all of them successful.
        algorithm: Algorithm that imitates.
        seed: Seed of the recording and of training.
        folder: Folder for the data set and the run.

    Returns:
        ``recording`` and ``training`` (durations of the commands [s]), ``demonstrator`` (values in :data:`RESULT`), and
        the values in :data:`RESULT` of the policy that imitates.
    """
    data, run, path = folder / "data", folder / "run", install_person(folder / "person")
    first = 1_000 * seed  # each episode has a seed of its own, which no other data set may share
    begin = perf_counter()
    words = ("--episodes", episodes, "--seed", first, "--success-only", "--out", data)
    frobs("record", PICK, "--policy", policy, *words, path=path)
    recording = perf_counter() - begin
    training = train(PICK, algorithm, seed, run, [f"algorithm_config.demonstrations={data}"])
    demonstrator = outcome(PICK, "--policy", policy, episodes=FEWER_EPISODES, path=path)
    return {"recording": recording, "training": training, "demonstrator": demonstrator, **outcome(run)}


def measure_reinforced(demonstrations: str | None, algorithm: str, seed: int, folder: Path) -> dict[str, Any]:
    """Train with rewards until an evaluation reaches :data:`SUCCESS`, with or without demonstrations.

    Returns:
        ``training`` (duration of the command [s]), ``steps`` (environment steps until then, or None), ``best`` (highest
        success rate in an evaluation during training), and the values in :data:`RESULT` of the last policy.
    """
    settings = [*SAC, *([f"algorithm_config.demonstrations={demonstrations}"] if demonstrations else [])]
    run = folder / "run"
    training = train(PICK, algorithm, seed, run, settings)
    return {"training": training, **first_success(read_progress(run / "progress.csv")), **outcome(run)}


def first_success(log: Mapping[str, Sequence[float]]) -> dict[str, Any]:
    """Return ``steps`` and ``best`` of :func:`measure_reinforced` from the columns of a run's log."""
    evaluations = [
        (int(steps), rate) for steps, rate in zip(log[STEPS], log["evaluation/success"], strict=True) if rate == rate
    ]
    reached = [steps for steps, rate in evaluations if rate >= SUCCESS]
    return {"steps": min(reached, default=None), "best": max((rate for _, rate in evaluations), default=None)}


def measure_improved(algorithm: str, seed: int, folder: Path) -> dict[str, Any]:
    """Imitate the expert at pushing, and improve the policy with rewards.

    Returns:
        ``cloning`` and ``training`` (durations of the commands [s]), and the values in :data:`RESULT` of ``expert``,
        ``clone`` and ``improved``.
    """
    clone, improved = folder / "clone", folder / "improved"
    cloning = train(PUSH, "bc", seed, clone, ["algorithm_config.demonstrations=expert"])
    training = train(PUSH, algorithm, seed, improved, [*PPO, f"algorithm_config.initial_policy={clone}"])
    expert = outcome(PUSH, "--policy", "expert", "--seed", seed)
    results = {"expert": expert, "clone": outcome(clone), "improved": outcome(improved)}
    return {"cloning": cloning, "training": training, **results}


@dataclass(frozen=True)
class Case:
    """A measurement.

    Attributes:
        name: Name on the command line.
        algorithm: Name of the algorithm.
        measure: Function of the algorithm, the seed and a folder for data sets and runs.
    """

    name: str
    algorithm: str
    measure: Callable[[str, int, Path], dict[str, Any]]

    def file(self, seed: int, kept: Path = KEPT) -> Path:
        """Return the file with the results of a seed."""
        return kept / f"{self.name}-{self.algorithm}-seed{seed}.json"


Rows: TypeAlias = Mapping[Case, Sequence[Mapping[str, Any]]]
"""Results of each case, one per seed."""

CASES = (
    Case("recorded-expert-100", "bc", partial(measure_recorded, "expert", 100)),
    Case("recorded-expert-100", "act", partial(measure_recorded, "expert", 100)),
    Case("recorded-person-20", "bc", partial(measure_recorded, "person", 20)),
    Case("recorded-person-20", "act", partial(measure_recorded, "person", 20)),
    Case("reinforced-alone", "sac", partial(measure_reinforced, None)),
    Case("reinforced-expert", "sac", partial(measure_reinforced, "expert")),
    Case("improved", "ppo", measure_improved),
)


def measure(case: Case, seed: int, kept: Path = KEPT, build: Path = BUILD) -> dict[str, Any]:
    """Return the results of a seed, which is measured first if they are not stored."""

    def run() -> dict[str, Any]:
        folder = build / case.file(seed).stem
        shutil.rmtree(folder, ignore_errors=True)  # an interrupted measurement begins again
        found = {"seed": seed, **case.measure(case.algorithm, seed, folder), "shared": is_shared()}
        sys.stderr.write(f"{case.name}, {case.algorithm}, seed {seed}: {found}\n")
        return found

    return stored(case.file(seed, kept), run)


def report(rows: Rows) -> str:
    """Return the page.

    Args:
        rows: Results of :func:`measure`. Cases without results are listed as missing.
    """
    every = [row for found in rows.values() for row in found]
    machines, commits = (sorted({row[key] for row in every}) for key in ("machine", "commit"))
    measured = f" Machines: {'; '.join(machines)}. Commits: {', '.join(commits)}." if every else ""
    lines = [
        "# Benchmarks: learning from demonstrations",
        "",
        f"Written by `tests/benchmarks/imitation.py` on {date.today():%d %B %Y}.{measured} Each row has the seeds "
        f"{SEEDS[0]} to {SEEDS[-1]}, unless its number of seeds is smaller. Success is the success rate of a policy in {EPISODES:,} new episodes (`frobs evaluate`): the worst seed and the median. "
        "The steps to success are the control steps that successful episodes took until the task was solved and stayed solved: "
        "the mean over the episodes, and the median over the seeds. Times are medians of whole commands. [Benchmarks: "
        "tasks](tasks-measured.md) shows how well each task is learned with its tuned settings.",
    ]
    parts = (_recorded, ("recorded-",)), (_reinforced, ("reinforced-",)), (_improved, ("improved",))
    for part, names in parts:
        lines += ["", *part({case: found for case, found in rows.items() if found and case.name.startswith(names)})]
    if any(row["shared"] for row in every):
        lines += ["", "Other programs used the machine during some of the runs, so the times are upper bounds."]
    if missing := [f"`{case.name}` with `{case.algorithm}`" for case in CASES if not rows.get(case)]:
        lines += ["", f"Not measured yet: {', '.join(missing)}."]
    return "\n".join(lines) + "\n"


def _recorded(rows: Rows) -> list[str]:
    lines = [
        "## Imitating a recording",
        "",
        f"`frobs record {PICK} --success-only` records successful episodes of the scripted expert, or of a policy that acts like "
        "a person: it pauses at random, overshoots and then corrects the motion, and its motions are noisy. `frobs train "
        "--algorithm NAME --set algorithm_config.demonstrations=FOLDER` then imitates the recording and nothing else: the expert "
        f"is not asked again. The last column shows how the demonstrator itself does in {FEWER_EPISODES} episodes.",
        "",
        "A policy that only imitates has never seen how to recover from its own errors, so its success depends on how many of the "
        "states around the path are part of the recording. It fails with few episodes and with tasks that need precision. "
        "`dagger` does not have this limit, but needs an expert that can be asked in every state. Pauses of a person depend on "
        "nothing that the policy observes. A policy without memory can only imitate their average, and moves more slowly.",
    ]
    if rows:
        lines += [
            "",
            "| recording | algorithm | seeds | to record | to train | worst success | median | steps to success | demonstrator |",
            "|---|---|---:|---:|---:|---:|---:|---:|---|",
        ]
    for case, found in rows.items():
        shown = found[0]["demonstrator"]
        lines.append(
            f"| `{case.name}` | `{case.algorithm}` | {len(found)} | {_seconds(found, 'recording')} | "
            f"{_seconds(found, 'training')} | {_success(found)} | {_steps(found)} | {shown['success_rate']:.1%} in "
            f"{_steps([shown])} steps |"
        )
    return lines


def _reinforced(rows: Rows) -> list[str]:
    lines = [
        "## Reinforcement learning with demonstrations",
        "",
        f"SAC learns `{PICK}` from its dense reward, without demonstrations (`reinforced-alone`) or with `algorithm_config.demonstrations="
        "expert` (`reinforced-expert`). Then half of each batch comes from episodes of the expert, and all other settings are the "
        f"same. Training ends when an evaluation of 100 episodes reaches {SUCCESS:.0%}, or after {MOST_STEPS:,} environment steps. "
        "Steps in which the expert demonstrates are not counted.",
        "",
        "Demonstrations show the states in which the reward is high, which random actions reach rarely: the fingers must close "
        "around the cube. They do not help if the reward of the expert's episodes is not higher than that of other episodes, and "
        "they take half of each batch even if the policy is already better than the expert.",
    ]
    if rows:
        lines += [
            "",
            f"| row | seeds | steps until {SUCCESS:.0%}, by seed | to train | best evaluation, by seed | worst success | median |",
            "|---|---:|---|---:|---|---:|---:|",
        ]
    for case, found in rows.items():
        reached = [f"{row['steps']:,}" if row["steps"] else f"not within {MOST_STEPS:,}" for row in found]
        best = ["–" if row["best"] is None else f"{row['best']:.0%}" for row in found]
        lines.append(
            f"| `{case.name}` | {len(found)} | {', '.join(reached)} | {_seconds(found, 'training')} | {', '.join(best)} | "
            f"{_success(found)} |"
        )
    return lines


def _improved(rows: Rows) -> list[str]:
    lines = [
        "## Improving a policy that imitates",
        "",
        f"`bc` clones the expert of `{PUSH}`, and PPO continues with `algorithm_config.initial_policy=RUN`: its policy and its value "
        "function are first fitted to episodes of the clone. Unlike imitation, PPO can become better than the expert, because it "
        "maximizes the reward. The expert is slow where its script waits or takes a detour, so the steps to success show the "
        "improvement even if the expert always succeeds.",
        "",
        "PPO can also forget what the clone knows: if its actions are too random at the start (`log_std_init`), or if the steps of "
        "its first updates are too large for a value function that knows only the clone's episodes. The reward decides what is "
        "improved: one that does not depend on time does not make the policy faster.",
    ]
    for found in rows.values():
        lines += [
            "",
            "| policy | seeds | to train | worst success | median | steps to success |",
            "|---|---:|---:|---:|---:|---:|",
        ]
        for name, time in (("expert", None), ("clone", "cloning"), ("improved", "training")):
            results = [row[name] for row in found]
            trained = _seconds(found, time) if time else "–"
            lines.append(f"| {name} | {len(found)} | {trained} | {_success(results)} | {_steps(results)} |")
    return lines


def _seconds(found: Sequence[Mapping[str, Any]], key: str) -> str:
    return f"{median(row[key] for row in found):,.0f} s"


def _success(results: Sequence[Mapping[str, Any]]) -> str:
    """Return two cells, the worst success rate and the median."""
    rates = [each["success_rate"] for each in results]
    return f"{min(rates):.1%} | {median(rates):.1%}"


def _steps(results: Sequence[Mapping[str, Any]]) -> str:
    known = [each["steps_to_success"] for each in results if each["steps_to_success"] is not None]
    return f"{median(known):.0f}" if known else "–"


def read_arguments(words: Sequence[str] | None = None) -> Namespace:
    """Return the arguments of the command line."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    names = list(dict.fromkeys(case.name for case in CASES))
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS), help="measure only these seeds")
    parser.add_argument("--fresh", action="store_true", help="discard the stored results of these names and seeds")
    parser.add_argument("--kept", action="store_true", help="measure nothing: write the page from the stored results")
    return parser.parse_args(words)


def main(words: Sequence[str] | None = None) -> None:
    """Measure, and write the page from all stored results."""
    given = read_arguments(words)
    wanted = [(case, seed) for case in CASES if case.name in given.only for seed in given.seeds]
    for case, seed in wanted:
        if given.fresh:
            case.file(seed, KEPT).unlink(missing_ok=True)
        if not given.kept:
            measure(case, seed, KEPT, BUILD)
    rows = {
        case: [measure(case, seed, KEPT, BUILD) for seed in SEEDS if case.file(seed, KEPT).is_file()] for case in CASES
    }
    PAGE.write_text(report(rows), "utf-8")


if __name__ == "__main__":
    main()
