"""Train, evaluate, compare and export policies.

    configuration/   settings, wrappers and callbacks by name, other YAML layouts
    runs/            run folder: checkpoints, locks, versions, policies
    training/        train, resume, seeds, threads, monitoring, interrupts
    logs/            progress.csv, TensorBoard events, episode statistics
    evaluation/      evaluate, play, video, view
    comparison/      statistics over seeds
    plots/           figures of learning curves and comparisons
    tuning/          search for training settings
    runners/         run many jobs on one or more machines
    export/          write policy bundles and use them like runs; pretrained policies
    cli/             commands

Public names are imported on first use, because most of the modules that define them import pydantic and Gymnasium.
"""

from typing import TYPE_CHECKING

from frobs_cli.lazy_names import lazy_names

if TYPE_CHECKING:
    from frobs_train.comparison.compare import Comparison as Comparison
    from frobs_train.comparison.compare import compare as compare
    from frobs_train.comparison.tables import write_table as write_table
    from frobs_train.configuration.config import ComponentConfig as ComponentConfig
    from frobs_train.configuration.config import ResetFromConfig as ResetFromConfig
    from frobs_train.configuration.config import RunConfig as RunConfig
    from frobs_train.configuration.config import ThreadsConfig as ThreadsConfig
    from frobs_train.configuration.layout_record import ConfigLayoutRecord as ConfigLayoutRecord
    from frobs_train.configuration.resolve import read_setting as read_setting
    from frobs_train.configuration.resolve import resolve_config as resolve_config
    from frobs_train.environments import EnvironmentRecipe as EnvironmentRecipe
    from frobs_train.environments import is_paced as is_paced
    from frobs_train.environments import make_env as make_env
    from frobs_train.environments import make_vector_env as make_vector_env
    from frobs_train.evaluation.evaluate import Evaluation as Evaluation
    from frobs_train.evaluation.evaluate import evaluate as evaluate
    from frobs_train.evaluation.playing import OctantResult as OctantResult
    from frobs_train.evaluation.video import record_video as record_video
    from frobs_train.evaluation.view import view as view
    from frobs_train.export.bundle_run import BundleRun as BundleRun
    from frobs_train.export.bundle_run import changes_since as changes_since
    from frobs_train.export.bundle_run import open_pretrained as open_pretrained
    from frobs_train.logs.recorder import EpisodeRecorder as EpisodeRecorder
    from frobs_train.logs.recorder import FinishedEpisodes as FinishedEpisodes
    from frobs_train.plots.figures import COLORS as COLORS
    from frobs_train.plots.figures import INK as INK
    from frobs_train.plots.figures import dress as dress
    from frobs_train.plots.figures import make_figure as make_figure
    from frobs_train.plots.plot import count_text as count_text
    from frobs_train.plots.plot import plot_runs as plot_runs
    from frobs_train.plots.plot_comparison import plot_comparison as plot_comparison
    from frobs_train.runners.runner import LOCAL as LOCAL
    from frobs_train.runners.runner import Job as Job
    from frobs_train.runners.runner import Outcome as Outcome
    from frobs_train.runners.runner import Report as Report
    from frobs_train.runners.runner import Runner as Runner
    from frobs_train.runners.runner import RunnerOptions as RunnerOptions
    from frobs_train.runners.runner import load_runner as load_runner
    from frobs_train.runners.runner import raise_failures as raise_failures
    from frobs_train.runners.seeds import train_seeds as train_seeds
    from frobs_train.runs.checkpoints import Checkpoint as Checkpoint
    from frobs_train.runs.existing_folder import ON_EXISTING as ON_EXISTING
    from frobs_train.runs.model_file import ModelFile as ModelFile
    from frobs_train.runs.policy import open_policy as open_policy
    from frobs_train.runs.policy_run import ExpertRun as ExpertRun
    from frobs_train.runs.policy_run import PolicyRun as PolicyRun
    from frobs_train.runs.run import Run as Run
    from frobs_train.runs.run import default_run_dir as default_run_dir
    from frobs_train.runs.run import find_runs as find_runs
    from frobs_train.runs.versions import versions as versions
    from frobs_train.training.callbacks import TrainingCallback as TrainingCallback
    from frobs_train.training.interrupts import TrainingInterrupt as TrainingInterrupt
    from frobs_train.training.monitor import Progress as Progress
    from frobs_train.training.resume import resume as resume
    from frobs_train.training.session import PreparedTraining as PreparedTraining
    from frobs_train.training.session import make_training_env as make_training_env
    from frobs_train.training.session import prepare_training as prepare_training
    from frobs_train.training.threads import Threads as Threads
    from frobs_train.training.threads import decide_threads as decide_threads
    from frobs_train.training.threads import usable_processors as usable_processors
    from frobs_train.training.train import train as train
    from frobs_train.tuning.search import Search as Search
    from frobs_train.tuning.study import StudyResult as StudyResult
    from frobs_train.tuning.study import TrialResult as TrialResult
    from frobs_train.tuning.tune import tune as tune

__all__, __getattr__ = lazy_names(__name__, __file__)
