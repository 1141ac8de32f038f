"""Create the trained policies that come with IDs: train, evaluate, export, and copy into the task's package.

``EnvironmentRecord.pretrained`` defines which IDs have a policy and where it is stored. ``--only`` also accepts IDs that
do not have one yet; add the name that is then printed to the records of their package. No file is created by hand::

    python tests/benchmarks/pretrained.py
    python tests/benchmarks/pretrained.py --only frobs/Irb120Reach-v0 --seed 1
    python tests/benchmarks/pretrained.py --only frobs/PandaPush-v0 --algorithm sbx_ppo

The algorithm is that of ``tasks.py`` for the ID: for manipulation tasks, ``dagger`` if it is tuned for the ID. If ``tasks.py`` has already trained the same seed, its run is used.
"""

from __future__ import annotations

import shutil
import sys
from argparse import ArgumentParser
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import tasks

from frobs_core.plugins.registry import environments, pretrained_ids, pretrained_path
from frobs_train import Run
from frobs_train.export.export import export

LICENSE = "MIT"


def make(
    case: tasks.Case, seed: int, episodes: int = tasks.EPISODES, steps: int | None = None, kept: Path = tasks.KEPT
) -> Path:
    """Train, evaluate and export.

    Args:
        case: Training run.
        seed: Seed of training.
        episodes: Number of episodes per evaluation.
        steps: Number of training steps; None: the tuned number.
        kept: Folder of finished seeds.

    Returns:
        The bundle, next to the run.
    """
    run = Run.open(kept / tasks.measure(case, seed, episodes, steps, kept)["run"])
    return export(run, run.path.parent / f"{case.slug}.frobs", license=LICENSE).path


def bundle_path(id: str) -> Path:
    """Return where an ID's policy is stored: as its record says, or by default, in the package of its task."""
    task, record = environments()[id]
    if record.pretrained:
        return pretrained_path(id)
    spec = find_spec(task.entry_point.partition(".")[0])
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent / "pretrained" / f"{tasks.slug(id).removesuffix('-v0')}.frobs"


def main() -> None:
    """Create all bundles before copying them, so that the commit that they name is of a clean tree."""
    parser = ArgumentParser(description=__doc__)
    known = {case.id: case for case in tasks.cases()}
    parser.add_argument(
        "--only", nargs="+", choices=sorted(known), metavar="ID", help="default: the IDs that have a policy"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--algorithm", metavar="NAME", help="algorithm; default: that of tasks.py for the ID")
    tasks.add_runner_options(parser)
    given = parser.parse_args()
    wanted = given.only or pretrained_ids()
    if untuned := [id for id in wanted if id not in known]:
        sys.exit(f"Nothing is tuned for {', '.join(untuned)}; add a file to the algorithm's record.")
    cases = [tasks.with_algorithm(known[id], given.algorithm) for id in wanted]
    if given.runner != tasks.LOCAL:
        tasks.measure_as_jobs(tasks.open_runner(given), [(case, given.seed) for case in cases])
    made = {case.id: make(case, given.seed) for case in cases}
    for id, bundle in made.items():
        target = bundle_path(id)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(bundle, target)
        missing = "" if environments()[id][1].pretrained else f" (add {id} to the records of its package)"
        sys.stdout.write(f"{target}{missing}\n")


if __name__ == "__main__":
    main()
