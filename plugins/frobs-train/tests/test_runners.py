from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import ConfigurationError, IncompatibleSpaceError, UnknownNameError
from frobs_train import RunConfig, resolve_config, train
from frobs_train.cli.train import _print
from frobs_train.errors import JobsError, RunExistsError
from frobs_train.logs.progress import read_progress
from frobs_train.runners.jobs import estimate_memory, evaluation_job
from frobs_train.runners.runner import Job, RunnerOptions, load_runner, raise_failures
from frobs_train.runners.seeds import train_seeds
from frobs_train.training.threads import processors_limited_to, usable_processors

LOCAL = load_runner("local")


def cart_pole(**flags: Any) -> RunConfig:
    settings = ("num_envs=4", "algorithm_config.n_steps=16", "algorithm_config.batch_size=64")
    return resolve_config("CartPole-v1", flags={"steps": 256, **flags}, settings=settings)


def fail_on_two(number: int, report: Any) -> int:
    if number == 2:
        raise ValueError("two is not allowed")
    return 10 * number


def test_a_failed_job_does_not_stop_the_others(tmp_path: Path) -> None:
    jobs = [Job(name=f"job {n}", function=f"{__name__}:fail_on_two", arguments={"number": n}) for n in (1, 2, 3)]
    outcomes = list(LOCAL.run(jobs, tmp_path))
    assert [outcome.result for outcome in outcomes] == [10, None, 30]
    with pytest.raises(JobsError, match=r"1 of 3 jobs failed. job 2: two is not allowed"):
        raise_failures(outcomes)
    raise_failures(outcomes[::2])


def test_an_unknown_runner_lists_the_installed_ones() -> None:
    with pytest.raises(UnknownNameError, match=r"no runner is named 'clusters'.*local"):
        load_runner("clusters")


def test_the_local_runner_refuses_options_of_others() -> None:
    with pytest.raises(ConfigurationError, match="--runner ray"):
        load_runner("local", RunnerOptions(processors=2))


def test_processors_can_be_limited() -> None:
    before = usable_processors()
    with processors_limited_to(1):
        assert usable_processors() == 1
    with processors_limited_to(10_000):
        assert usable_processors() == before
    assert usable_processors() == before


def test_a_replay_buffer_needs_more_memory() -> None:
    small = resolve_config("Pendulum-v1", flags={"algorithm": "sac"}, settings=["algorithm_config.buffer_size=1000"])
    large = resolve_config("Pendulum-v1", flags={"algorithm": "sac"}, settings=["algorithm_config.buffer_size=1000000"])
    assert estimate_memory(small) >= 2**30
    assert estimate_memory(large) - estimate_memory(small) > 900e6


def test_each_seed_equals_a_run_of_its_own(tmp_path: Path) -> None:
    outcomes = list(train_seeds(cart_pole(), [3, 4], LOCAL, tmp_path / "seeds"))
    assert [Path(outcome.result["run"]).name for outcome in outcomes] == ["seed3", "seed4"]
    alone = train(cart_pole(seed=4), tmp_path / "alone")
    ours, theirs = (read_progress(path / "progress.csv") for path in (tmp_path / "seeds" / "seed4", alone.path))
    for name in ours:
        if not name.startswith("time/"):
            assert ours[name] == pytest.approx(theirs[name], nan_ok=True, rel=0, abs=0)
    assert outcomes[1].result["reward"] == theirs["episode/reward"][-1]
    evaluated = next(LOCAL.run([evaluation_job(alone.path, episodes=4)], tmp_path))
    assert evaluated.result["episodes"] == 4


def test_finished_seeds_are_not_trained_again(tmp_path: Path) -> None:
    list(train_seeds(cart_pole(), [0], LOCAL, tmp_path))
    written = (tmp_path / "seed0" / "progress.csv").stat().st_mtime_ns
    with pytest.raises(RunExistsError):
        next(train_seeds(cart_pole(), [0, 1], LOCAL, tmp_path))
    assert not (tmp_path / "seed1").exists()
    outcomes = list(train_seeds(cart_pole(), [0, 1], LOCAL, tmp_path, on_existing="resume"))
    assert all(outcome.error is None for outcome in outcomes)
    assert (tmp_path / "seed0" / "progress.csv").stat().st_mtime_ns == written


def test_bad_input_is_found_before_a_seed_begins(tmp_path: Path) -> None:
    with pytest.raises(IncompatibleSpaceError):
        next(train_seeds(cart_pole(algorithm="sac"), [0, 1], LOCAL, tmp_path / "runs"))
    assert not (tmp_path / "runs").exists()


def test_the_next_command_names_the_runs_that_were_trained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    row = {"success": None, "reward": 1.0, "seconds": 1.0}
    _print(cart_pole(), [{**row, "seed": seed, "run": tmp_path / "my runs" / f"seed{seed}_2"} for seed in (0, 1)])
    assert capsys.readouterr().out.splitlines()[-1] == "next: frobs compare 'my runs/seed0_2' 'my runs/seed1_2'"
