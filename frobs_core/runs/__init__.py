"""Runs: training, evaluating, showing and plotting, each with one folder in which everything lies.

Imported by those who train, never by ``import frobs_core``: it needs pydantic.
"""

from frobs_core.runs.compare import Comparison, compare
from frobs_core.runs.config import RunConfig, resolve_config
from frobs_core.runs.evaluate import Evaluation, OctantResult, evaluate
from frobs_core.runs.monitor import Progress
from frobs_core.runs.plot import plot_runs
from frobs_core.runs.plot_comparison import plot_comparison
from frobs_core.runs.run import Run, default_run_dir
from frobs_core.runs.train import train
from frobs_core.runs.video import record_video
from frobs_core.runs.view import view

__all__ = [
    "Comparison",
    "Evaluation",
    "OctantResult",
    "Progress",
    "Run",
    "RunConfig",
    "compare",
    "default_run_dir",
    "evaluate",
    "plot_comparison",
    "plot_runs",
    "record_video",
    "resolve_config",
    "train",
    "view",
]
