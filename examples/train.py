"""Train an arm to reach, evaluate it, and plot its learning curve.

An IRB 120 learns to move its tool to random goals and to hold it there. Each action moves the tool directly, so 40,000
steps are enough, and training takes about ten seconds. The script prints the progress, the success rate on 200 goals
that were not used in training (close to 100 %), and the path of the plot.

Requires: pip install frobs
"""

import sys

from frobs_train import Progress, evaluate, plot_runs, resolve_config, train

ID = "frobs/Irb120Reach-v0"
STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 40_000


def show(progress: Progress) -> None:
    """Print one line for each row of the log."""
    print(f"{progress.steps:7,} steps  success {progress.success or 0.0:.0%}")


config = resolve_config(ID, flags={"controller": "tcp_delta_position", "seed": 0, "steps": STEPS})
run = train(config, "runs/examples/train", show, on_existing="overwrite")

evaluation = evaluate(run, episodes=200)
assert evaluation.success_interval is not None  # this environment reports success
low, high = evaluation.success_interval
print(f"success {evaluation.success_rate:.1%} (95 % interval {low:.1%} to {high:.1%})")
print(f"learning curve: {plot_runs([run])}")
