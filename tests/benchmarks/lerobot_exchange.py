"""Exchange data sets, policies and environments with LeRobot, and write ``docs/explanation/lerobot-measured.md``.

LeRobot needs an environment of its own; ``docs/how-to/lerobot.md`` shows how to install it together with FRobs. The
exchange takes some minutes, the training with 100 episodes an hour or more without a GPU::

    python tests/benchmarks/lerobot_exchange.py lerobot/bin/python
    python tests/benchmarks/lerobot_exchange.py lerobot/bin/python --only training
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping
from datetime import date
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from common import RESULTS, ROOT, current_commit, frobs, machine

from frobs_data import Dataset

PAGE = ROOT / "docs" / "explanation" / "lerobot-measured.md"
ID = "frobs/PandaPickAndPlace-v0"
SMALL = {
    "chunk_size": 10,
    "n_action_steps": 10,
    "dim_model": 128,
    "dim_feedforward": 256,
    "n_heads": 4,
    "pretrained_backbone_weights": "null",
    "push_to_hub": "false",
}
"""Settings of the ACT policies."""


class LeRobot:
    """LeRobot in an environment of its own.

    Args:
        python: Its Python.
    """

    def __init__(self, python: str) -> None:
        self.python = python

    def run(self, *arguments: object) -> str:
        """Run Python with arguments, and return what it prints.

        Raises:
            SystemExit: The program failed.
        """
        command = [self.python, *map(str, arguments)]
        done = subprocess.run(command, text=True, capture_output=True, env={**os.environ, "HF_HUB_OFFLINE": "1"})
        if done.returncode:
            raise SystemExit(f"{' '.join(command)}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
        return done.stdout

    def check(self, *arguments: object) -> dict[str, Any]:
        """Run a check of ``lerobot_side.py`` and return its results."""
        output = self.run(Path(__file__).with_name("lerobot_side.py"), *arguments)
        result: dict[str, Any] = json.loads(output.rstrip().rpartition("\n")[2])
        return result

    def train(self, data: Path, out: Path, steps: int, device: str) -> float:
        """Train an ACT policy with ``lerobot-train`` and return the time that it took [s]."""
        settings = {f"policy.{name}": value for name, value in {"type": "act", "device": device, **SMALL}.items()}
        settings |= {"dataset.repo_id": "frobs/exchange", "dataset.root": data, "output_dir": out, "steps": steps}
        settings |= {"batch_size": 32, "num_workers": 0, "env_eval_freq": 0, "prefetch_factor": 2}
        settings |= {"persistent_workers": "false", "save_freq": steps}
        start = monotonic()
        self.run("-m", "lerobot.scripts.lerobot_train", *_flags(settings))
        return monotonic() - start

    def evaluate(self, policy: Path, episodes: int, out: Path, **env: object) -> dict[str, Any]:
        """Evaluate a policy with ``lerobot-eval`` and return its aggregated results."""
        settings = {"policy.path": policy, "policy.device": "cpu", "output_dir": out, "env.type": "frobs"}
        settings |= {f"env.{name}": value for name, value in {"task": ID, **env}.items()}
        settings |= {"eval.n_episodes": episodes, "eval.batch_size": 2}
        self.run("-m", "lerobot.scripts.lerobot_eval", *_flags(settings))
        result: dict[str, Any] = json.loads((out / "eval_info.json").read_text("utf-8"))["overall"]
        return {**result, "videos": len(list(out.rglob("*.mp4")))}


def _flags(settings: Mapping[str, object]) -> list[str]:
    return [f"--{name}={value}" for name, value in settings.items()]


def record(folder: Path, episodes: int, *options: object) -> Dataset:
    """Record successful episodes of the expert."""
    frobs("record", ID, "--episodes", episodes, "--success-only", "--out", folder, *options)
    return Dataset(folder)


def all_values(data: Dataset) -> dict[str, np.ndarray[Any, Any]]:
    """Return all columns and pictures of a data set by name."""
    cameras = [name for name, feature in data.features.items() if feature.dtype == "video"]
    episodes = range(len(data.episodes))
    pictures = {key: np.concatenate([data.pictures(each, key) for each in episodes]) for key in cameras}
    return {**data.columns([name for name in data.features if name not in cameras]), **pictures}


def measure_exchange(lerobot: LeRobot, folder: Path) -> dict[str, Any]:
    """Exchange a data set of three episodes, and evaluate a policy that LeRobot trained for a few steps."""
    data = record(folder / "recorded", 3, "--cameras", "overview")
    truth = all_values(data)
    np.savez(folder / "truth.npz", **truth)
    appended, merged = folder / "appended", folder / "merged"
    edited = lerobot.check("edit", data.folder, appended, merged)
    returned = {name: _compare(Dataset(each), truth) for name, each in {"appended": appended, "merged": merged}.items()}
    lerobot.train(data.folder, folder / "trained", 5, "cpu")
    policy = folder / "trained" / "checkpoints" / "last" / "pretrained_model"
    evaluated = lerobot.evaluate(policy, 4, folder / "evaluated", cameras="overview", episode_length=20)
    return {
        "versions": lerobot.check("versions"),
        "read": lerobot.check("read", data.folder, folder / "truth.npz"),
        "edited": edited,
        "returned": returned,
        "evaluated": evaluated,
        "expert": lerobot.check("expert", ID, 4),
    }


def _compare(data: Dataset, truth: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, Any]:
    """Compare the first frames of a data set that LeRobot wrote with those that FRobs recorded."""
    values = all_values(data)
    equal = [name for name in truth if np.array_equal(values[name][: len(truth[name])], truth[name])]
    return {"frames": len(data), "episodes": len(data.episodes), "different": sorted(truth.keys() - set(equal))}


def measure_training(lerobot: LeRobot, folder: Path, steps: int, device: str) -> dict[str, Any]:
    """Train ACT on 100 episodes without pictures, and evaluate it."""
    data = record(folder / "recorded", 100)
    seconds = lerobot.train(data.folder, folder / "trained", steps, device)
    policy = folder / "trained" / "checkpoints" / "last" / "pretrained_model"
    result = lerobot.evaluate(policy, 50, folder / "evaluated")
    return {
        "versions": lerobot.check("versions"),
        "episodes": len(data.episodes),
        "frames": len(data),
        "steps": steps,
        "device": device,
        "seconds": seconds,
        "success": result["pc_success"],
    }


def report(results: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the page for the results of both parts, or of one."""
    return "\n".join(["# Benchmarks: exchange with LeRobot", "", *_lines(results), ""])


def _lines(results: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    yield "`tests/benchmarks/lerobot_exchange.py` runs [LeRobot](../how-to/lerobot.md) in an environment of its own."
    if exchange := results.get("exchange"):
        yield from ("", "## Data sets and environments", "", *_conditions(exchange), "")
        yield f"The expert records 3 episodes of `{ID}`, {exchange['read']['frames']} frames with a 96 × 96 camera."
        yield from ("", "| check | result |", "|---|---|", *_exchange_rows(exchange))
    if training := results.get("training"):
        yield from ("", "## Training with LeRobot", "", *_conditions(training), "")
        yield (
            f"`lerobot-train` trains a small ACT policy without pictures on {training['episodes']} episodes of the expert in"
            f" `{ID}` ({training['frames']:,} frames), {training['steps']:,} steps on {training['device']} in"
            f" {training['seconds'] / 60:.0f} minutes. In 50 episodes of `lerobot-eval`, it succeeds in"
            f" {training['success']:.0f} %."
        )


def _conditions(result: Mapping[str, Any]) -> Iterator[str]:
    versions = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    yield f"Measured on {result['date']}, at commit {result['commit']}. FRobs: {result['machine']}. LeRobot: {versions}."


def _exchange_rows(result: Mapping[str, Any]) -> Iterator[str]:
    read, expert, evaluated = result["read"], result["expert"], result["evaluated"]
    yield f"| LeRobot reads all frames | {len(read['columns'])} columns equal those that FRobs reads, bit for bit |"
    for backend, largest in read["pictures"].items():
        found = f"largest difference of a pixel {largest} of 255" if isinstance(largest, int) else f"not run: {largest}"
        yield f"| LeRobot decodes all pictures with {backend} | {found} |"
    yield f"| `delta_timestamps`, at the ends of episodes too | {read['wrong']} of {read['windows']} windows wrong |"
    for name, found in result["returned"].items():
        changed = ", ".join(f"`{each}`" for each in found["different"]) or "no values changed"
        text = f"{found['episodes']} episodes, {found['frames']} frames; {changed}"
        yield f"| FRobs reads the set that LeRobot {name} | {text} |"
    yield f"| the expert acts in LeRobot's rollout | {expert['successes']} of {expert['episodes']} episodes succeed |"
    seen = ", ".join(f"`{name}` {shape}" for name, shape in expert["seen"].items())
    yield f"| a policy of LeRobot sees | {seen}, “{expert['sentence']}” |"
    text = f"{evaluated['n_episodes']} episodes, {evaluated['pc_success']:.0f} % success, {evaluated['videos']} videos"
    yield f"| `lerobot-eval` of an ACT policy that `lerobot-train` trained for 5 steps | {text} |"


def main() -> None:
    """Measure one part or both, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument(
        "python", help="Python of an environment with LeRobot, lerobot_env_frobs and the parts of the ID"
    )
    parser.add_argument("--only", choices=("exchange", "training"), default="exchange", help="part to measure")
    parser.add_argument("--steps", type=int, default=5000, help="steps of the training")
    parser.add_argument("--device", default="cpu", help="device of the training")
    options = parser.parse_args()
    lerobot = LeRobot(options.python)
    with tempfile.TemporaryDirectory() as name:
        if options.only == "exchange":
            found = measure_exchange(lerobot, Path(name))
        else:
            found = measure_training(lerobot, Path(name), options.steps, options.device)
    found |= {"date": f"{date.today():%-d %B %Y}", "commit": current_commit(), "machine": machine()}
    folder = RESULTS / "lerobot"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{options.only}.json").write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    stored = {file.stem: json.loads(file.read_text("utf-8")) for file in folder.glob("*.json")}
    PAGE.write_text(report(stored), "utf-8")


if __name__ == "__main__":
    main()
