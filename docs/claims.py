"""Draw the chart of the README from the stored measurements: ``python docs/claims.py``."""

import json
from pathlib import Path
from statistics import median
from typing import Any

from matplotlib import rcParams
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[1]
BENCHMARKS = ROOT / "tests" / "benchmarks"
TARGET = ROOT / "docs" / "images" / "claims.png"
COLOR, OTHERS, TEXT, GRID = "#b3450b", "#9aa4af", "#30363d", "#d0d7de"
TASKS = {
    "Reach a moving goal": ("frobs/Irb120ReachDynamic-v0", "ppo"),
    "Pick and place": ("frobs/PandaPickAndPlace-v0", "dagger"),
    "Open a door": ("frobs/Ur5OpenDoor-v0", "dagger"),
    "Stack": ("frobs/PandaStack-v0", "dagger"),
    "Push": ("frobs/PandaPush-v0", "dagger"),
    "Insert a peg": ("frobs/PandaPegInsertion-v0", "dagger"),
}
"""Environment ID and algorithm of each bar."""
SPEEDS = {
    "robosuite, Lift": "robosuite, Lift",
    "Gymnasium-Robotics, FetchPickAndPlace": "Gymnasium-Robotics, FetchPickAndPlace-v4",
    "panda-gym, PandaPickAndPlace": "panda-gym, PandaPickAndPlace-v3",
    "FRobs, PandaPickAndPlace": "FRobs, frobs/PandaPickAndPlace-v0, one environment",
    "FRobs, 1,024 environments": "FRobs, frobs/PandaPickAndPlace-v0, 1,024 environments",
}
"""Label and measured name of each bar."""


def training() -> list[tuple[str, float, float]]:
    """Return label, median training time [min] and worst success rate of the seeds of each task, longest first."""
    rows = json.loads((BENCHMARKS / "tasks_measured.json").read_text("utf-8"))
    bars = []
    for label, (env_id, algorithm) in TASKS.items():
        seeds = [row for row in rows if row["id"] == env_id and row["algorithm"] == algorithm]
        success = min(row["mujoco"]["success_rate"] for row in seeds)
        bars.append((label, median(row["seconds"] for row in seeds) / 60.0, success))
    seen = json.loads((BENCHMARKS / "results" / "vision" / "pick_0.json").read_text("utf-8"))
    bars.append(("Pick and place, from two cameras", seen["minutes"], seen["seen"]))
    return sorted(bars, key=lambda bar: -bar[1])


def speeds() -> list[tuple[str, float]]:
    """Return label and control steps per second of similar tasks."""
    measured = json.loads((BENCHMARKS / "results" / "neighbours" / "speeds.json").read_text("utf-8"))["speeds"]
    return [(label, measured[name]) for label, name in SPEEDS.items()]


def description() -> str:
    """Return the numbers of the chart, which its file contains."""
    return json.dumps([training(), speeds()])


def draw_training(axes: Any) -> None:
    """Draw the training times."""
    bars = training()
    axes.barh([label for label, _, _ in bars], [minutes for _, minutes, _ in bars], color=COLOR, height=0.62)
    for row, (_, minutes, success) in enumerate(bars):
        time = f"{60.0 * minutes:.0f} s" if minutes < 2.5 else f"{minutes:.1f} min"
        axes.text(minutes + 0.15, row, f"{time}, {success:.1%} success", va="center", color=TEXT)
    axes.set_xlim(0.0, 1.85 * bars[0][1])
    axes.set_xlabel("training time on two processor cores [min]")


def draw_speeds(axes: Any) -> None:
    """Draw the steps per second."""
    bars = speeds()
    for row, (label, speed) in enumerate(bars):
        axes.barh(label, speed, color=COLOR if label.startswith("FRobs") else OTHERS, height=0.62)
        axes.text(speed + 40, row, f"{speed:,.0f}", va="center", color=TEXT)
    axes.set_xlim(0.0, 1.2 * max(speed for _, speed in bars))
    axes.set_xlabel("control steps per second")


def main() -> None:
    """Write the chart."""
    rcParams.update({"font.size": 11, "text.color": TEXT, "axes.labelcolor": TEXT, "axes.edgecolor": GRID})
    rcParams.update({"xtick.color": TEXT, "ytick.color": TEXT})
    figure = Figure(figsize=(13.4, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    draw_training(left)
    draw_speeds(right)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(length=0)
    figure.savefig(TARGET, dpi=150, metadata={"Description": description()})


if __name__ == "__main__":
    main()
