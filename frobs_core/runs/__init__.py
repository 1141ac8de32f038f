"""Runs: training, evaluating, showing and plotting, each with one folder in which everything lies.

Imported by those who train, never by ``import frobs_core``: it needs pydantic.
"""

from frobs_core.runs.bundle import open_pretrained
from frobs_core.runs.callbacks import TrainingCallback
from frobs_core.runs.checkpoints import Checkpoint
from frobs_core.runs.compare import Comparison, compare
from frobs_core.runs.config import PartConfig, RunConfig, ThreadsConfig
from frobs_core.runs.evaluate import Evaluation, evaluate
from frobs_core.runs.existing import ON_EXISTING
from frobs_core.runs.interrupts import TrainingInterrupt
from frobs_core.runs.model_file import ModelFile
from frobs_core.runs.monitor import Progress
from frobs_core.runs.playing import OctantResult
from frobs_core.runs.plot import plot_runs
from frobs_core.runs.plot_comparison import plot_comparison
from frobs_core.runs.resolve import resolve_config
from frobs_core.runs.resume import resume
from frobs_core.runs.run import Run, default_run_dir
from frobs_core.runs.study import StudyResult, TrialResult
from frobs_core.runs.threads import Threads, decide_threads
from frobs_core.runs.train import train
from frobs_core.runs.tune import Search, tune
from frobs_core.runs.video import record_video
from frobs_core.runs.view import view

__all__ = [
    "ON_EXISTING",
    "Checkpoint",
    "Comparison",
    "Evaluation",
    "ModelFile",
    "OctantResult",
    "PartConfig",
    "Progress",
    "Run",
    "RunConfig",
    "Search",
    "StudyResult",
    "Threads",
    "ThreadsConfig",
    "TrainingCallback",
    "TrainingInterrupt",
    "TrialResult",
    "compare",
    "decide_threads",
    "default_run_dir",
    "evaluate",
    "open_pretrained",
    "plot_comparison",
    "plot_runs",
    "record_video",
    "resolve_config",
    "resume",
    "train",
    "tune",
    "view",
]
