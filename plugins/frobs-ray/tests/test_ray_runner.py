from __future__ import annotations

import json
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest
from two_nodes import TwoNodes, finish, wait_for

from frobs_core.util.errors import ConfigurationError, ParameterValueError
from frobs_ray.errors import ClusterResourcesError, NodesDifferError
from frobs_ray.nodes import describe_differences, flat_versions
from frobs_train import Run, resolve_config, train
from frobs_train.logs.progress import read_progress
from frobs_train.runners.jobs import training_job
from frobs_train.runners.runner import load_runner

REACH = "frobs/Irb120Reach-v0"
SMALL = ["--set", "algorithm_config.n_steps=32", "--set", "checkpoint_every=2000", "--set", "log_every=1000"]


def columns(run: Path) -> dict[str, list[float]]:
    return {
        name: values for name, values in read_progress(run / "progress.csv").items() if not name.startswith("time/")
    }


@pytest.mark.slow
def test_seeds_survive_a_dead_node_and_equal_runs_without_ray(two_nodes: TwoNodes) -> None:
    command = ["train", REACH, "--seeds", "3", "--num-envs", "8", "--steps", "20000", *SMALL, "--json"]
    process = two_nodes.start(*command)
    runs = [two_nodes.folder / "runs" / REACH / f"ppo_seed{seed}" for seed in range(3)]
    wait_for(lambda: sum(any(run.glob("checkpoints/step_*")) for run in runs) >= 2, process)
    two_nodes.replace_second()
    finished = finish(process)
    assert finished.returncode == 0, finished.stderr
    found = json.loads(finished.stdout)
    assert [row["seed"] for row in found] == [0, 1, 2]
    for seed, run in enumerate(runs):
        config = Run.open(run).config
        alone = train(config, two_nodes.folder / f"alone{seed}")
        ours, theirs = columns(run), columns(alone.path)
        assert ours.keys() == theirs.keys()
        for name, values in ours.items():
            assert values == pytest.approx(theirs[name], nan_ok=True, rel=0, abs=0), name
    assert not list(two_nodes.folder.glob("runs/**/.frobs-*"))


@pytest.mark.slow
def test_ctrl_c_writes_checkpoints_and_resuming_finishes(two_nodes: TwoNodes) -> None:
    command = ["train", REACH, "--seeds", "2", "--num-envs", "8", "--steps", "20000", *SMALL]
    process = two_nodes.start(*command)
    runs = [two_nodes.folder / "runs" / REACH / f"ppo_seed{seed}" for seed in range(2)]
    wait_for(lambda: all((run / "progress.csv").is_file() for run in runs), process)
    process.send_signal(signal.SIGINT)
    stopped = finish(process)
    assert stopped.returncode == 130, stopped.stderr
    assert "--on-existing resume" in stopped.stderr
    assert "Traceback" not in stopped.stderr
    steps = [Run.open(run).newest_checkpoint()[0].steps for run in runs]
    assert all(0 < each < 20_000 for each in steps)
    resumed = two_nodes.run(*command, "--on-existing", "resume")
    assert resumed.returncode == 0, resumed.stderr
    assert [Run.open(run).newest_checkpoint()[0].steps for run in runs] == [20_224, 20_224]


@pytest.mark.slow
@pytest.mark.needs("mounts")
def test_what_a_node_lacks_is_named_before_anything_begins(two_nodes: TwoNodes) -> None:
    """The second node has another folder in the place of ours, and a plugin whose entry points are empty."""
    from importlib.metadata import distribution

    entry_points = distribution("frobs-tasks-reach").locate_file("")
    folder = next(Path(str(entry_points)).glob("frobs_tasks_reach-*.dist-info"))
    hidden = f"mount -t tmpfs none {two_nodes.folder} && mount --bind /dev/null {folder}/entry_points.txt"
    two_nodes.cluster.remove_node(two_nodes.second)
    ray = Path(os.sys.executable).parent / "ray"  # type: ignore[attr-defined]
    start = f"{ray} start --address {two_nodes.cluster.address} --num-cpus 1 --object-store-memory 100000000 --block"
    node = subprocess.Popen(
        ["unshare", "-m", "sh", "-c", f"{hidden} && exec {start}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        two_nodes.cluster.wait_for_nodes = None
        finished = _until_two_nodes(two_nodes, ["train", REACH, "--seeds", "2", "--steps", "1000"])
    finally:
        os.killpg(node.pid, signal.SIGTERM)
        node.wait()
    assert finished.returncode == 2
    assert f"the node cannot write to the folder {two_nodes.folder}" in finished.stderr
    assert "frobs-tasks-reach" in finished.stderr
    assert "Install the same versions" in finished.stderr
    assert not list(two_nodes.folder.glob("runs/**/config.yaml"))


def _until_two_nodes(two_nodes: TwoNodes, command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a command once the node that was started by hand has joined."""
    import ray

    ray.init(two_nodes.cluster.address, log_to_driver=False)
    try:
        import time

        for _ in range(600):
            if sum(node["Alive"] for node in ray.nodes()) == 2:  # type: ignore[no-untyped-call]
                break
            time.sleep(0.2)
    finally:
        ray.shutdown()
    return two_nodes.run(*command)


@pytest.mark.slow
def test_too_little_memory_is_named(tmp_path: Path, two_nodes: TwoNodes) -> None:
    finished = two_nodes.run("train", REACH, "--seeds", "2", "--memory", "100000")
    assert finished.returncode == 2
    assert (
        "a job needs 1 processor and 100000.0 GB of memory, but no node has enough of both (per node: at most 1 CPU"
        in finished.stderr
    )
    assert "lower --cpus or --memory" in finished.stderr


def test_jobs_cannot_start_environment_runners(tmp_path: Path) -> None:
    settings = ["algorithm_config.num_env_runners=2"]
    config = resolve_config(REACH, flags={"algorithm": "rllib_ppo", "seed": 0}, settings=settings)
    jobs = [training_job(config, tmp_path / "run")]
    with pytest.raises(ParameterValueError, match="num_env_runners is 2; it must be 0 with --runner ray"):
        next(load_runner("ray").run(jobs, tmp_path))


def test_the_error_names_each_difference_by_node() -> None:
    here = {"Python": "3.11", "frobs-core": "0.2.0", "acme-arm": "1.0"}
    lines = describe_differences(here, {"Python": "3.12", "frobs-core": "0.2.0"})
    assert lines == ["Python is 3.12 on the node and 3.11 on this machine", "acme-arm 1.0 is missing on the node"]
    error = NodesDifferError({"10.0.0.2": lines})
    assert "10.0.0.2: Python is 3.12 on the node and 3.11 on this machine; acme-arm 1.0 is missing on the node" in str(
        error
    )
    assert isinstance(error, ConfigurationError)


def test_versions_contain_plugins_and_libraries() -> None:
    found = flat_versions()
    assert {"Python", "frobs-core", "frobs-tasks-reach", "mujoco", "torch"} <= set(found)


def test_the_error_names_the_largest_node() -> None:
    nodes: list[dict[str, Any]] = [{"CPU": 2, "memory": 4e9}, {"CPU": 8, "memory": 16e9}]
    error = ClusterResourcesError(16, int(32e9), nodes)
    assert (
        "a job needs 16 processors and 32.0 GB of memory, but no node has enough of both "
        "(per node: at most 8 CPUs and 16.0 GB)"
    ) in str(error)
