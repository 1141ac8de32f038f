"""Continuing a run in this process; what only kill -9 can show is in test_kill.py."""

from __future__ import annotations

import random
import shutil
from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import CheckpointError, ConfigurationError, RunError
from frobs_train import Progress, Run, RunConfig, evaluate, resume, train
from frobs_train.errors import RunExistsError
from frobs_train.logs.progress import STEPS, read_progress, read_rows

FAST = {"n_steps": 8, "batch_size": 16, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}}
NORMAL = {**FAST, "normalize_observation": True, "normalize_reward": True, "learning_rate": "lin_1e-3"}
RANDOMIZED = {"mass": {"scale": [0.8, 1.2]}, "action_delay": {"steps": [0, 3]}}


class Killed(BaseException):
    """Stands for a kill: nothing catches it, and nothing is written after it."""


def config(**changes: Any) -> RunConfig:
    values: dict[str, Any] = {"environment": "FrobsTests/Line-v0", "num_envs": 2, "steps": 160, "seed": 0}
    return RunConfig(**{**values, "algorithm_config": FAST, "checkpoint_every": 32, "log_every": 1, **changes})


def train_until(steps: int, config: RunConfig, path: Path) -> Run:
    def on_progress(progress: Progress) -> None:
        if progress.steps >= steps:
            raise Killed

    with pytest.raises(Killed):
        train(config, path, on_progress)
    return Run.open(path)


def rows(run: Run) -> list[dict[str, str]]:
    found = read_rows(run.path / "progress.csv")
    return [{key: value for key, value in row.items() if not key.startswith("time/")} for row in found]


def state(run: Run) -> dict[str, bytes]:
    last = run.checkpoints[-1].path
    found = [path for path in last.rglob("*") if path.is_file() and path.name not in ("run.json", "checksums.json")]
    return {str(path.relative_to(last)): path.read_bytes() for path in found}


OFF = {"learning_starts": 40, "batch_size": 16, "buffer_size": 150, "policy_kwargs": {"net_arch": [8]}}
SDE = {"use_sde": True}


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({"algorithm_config": NORMAL}, id="normalised", marks=pytest.mark.slow),
        pytest.param({"algorithm_config": {**NORMAL, **SDE}}, id="gSDE", marks=pytest.mark.slow),
        pytest.param({"algorithm": "sac", "algorithm_config": {**OFF, "learning_rate": "lin_1e-3"}}, id="SAC"),
        pytest.param(
            {"algorithm": "sac", "algorithm_config": {**OFF, **SDE, "normalize_observation": True}},
            id="SAC, gSDE",
            marks=pytest.mark.slow,
        ),
        pytest.param({"algorithm": "td3", "algorithm_config": OFF}, id="TD3", marks=pytest.mark.slow),
        pytest.param(
            {
                "algorithm": "dqn",
                "algorithm_config": OFF,
                "environment_kwargs": {"controller": "discrete"},
            },
            id="DQN",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {
                "algorithm": "sac",
                "environment": "frobs/Irb120ReachGoal-v0",
                "algorithm_config": {**OFF, "buffer_size": 400},
                "steps": 240,
            },
            id="HER",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"randomize": RANDOMIZED, "environment_kwargs": {"controller": "tcp_delta_position"}}, id="delays"
        ),
        pytest.param(
            {"environment_kwargs": {"simulator": "pybullet"}},
            id="PyBullet",
            marks=[pytest.mark.slow, pytest.mark.needs("pybullet")],
        ),
        pytest.param(
            {"num_envs": {"pybullet": 1, "mujoco": 2}, "randomize": RANDOMIZED, "stagger": True},
            id="two simulators",
            marks=pytest.mark.needs("pybullet"),
        ),
        pytest.param(
            {
                "algorithm": "sac",
                "environment": "frobs/Irb120ReachGoal-v0",
                "algorithm_config": {**OFF, "buffer_size": 400},
                "num_envs": {"mujoco": 1, "pybullet": 1},
                "steps": 240,
            },
            id="HER, two simulators",
            marks=[pytest.mark.slow, pytest.mark.needs("pybullet")],
        ),
        *(
            pytest.param(
                {
                    "algorithm": algorithm,
                    "environment": "frobs/PandaPush-v0",
                    "algorithm_config": settings,
                    "num_envs": {"mujoco": 1, "pybullet": 1},
                    "reset_from": reset_from,
                },
                id=f"{algorithm}, two simulators",
                marks=[pytest.mark.slow, pytest.mark.needs("pybullet")],
            )
            for algorithm, settings, reset_from in (
                ("dagger", {"updates": 4, "final_updates": 4}, None),
                ("bc", {"demonstration_episodes": 2}, None),
                ("sbx_ppo", {**FAST, "n_steps": 16}, {"share": 0.5}),
            )
        ),
        pytest.param(
            {"num_envs": 1, "log_every": 40, "checkpoint_every": 48}, id="one environment", marks=pytest.mark.slow
        ),
        pytest.param({"wrappers": [{"name": "components_to_name:Counting"}]}, id="wrapper", marks=pytest.mark.slow),
        pytest.param({"evaluate_every": 48, "evaluation_episodes": 2}, id="evaluated", marks=pytest.mark.slow),
    ],
)
def test_a_continued_run_equals_one_that_never_stopped(changes: dict[str, Any], tmp_path: Path) -> None:
    wanted = config(**{"environment": "frobs/Irb120Reach-v0", **changes})
    whole = train(wanted, tmp_path / "whole")
    resumed = resume(train_until(100, wanted, tmp_path / "killed"))
    assert rows(resumed) == rows(whole)
    assert state(resumed) == state(whole)


def test_the_log_has_one_header_and_events_are_cut(tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    run = train_until(110, config(), tmp_path / "run")
    with (run.path / "progress.csv").open("a") as file:
        file.write("1,2,3")  # a kill cut the row short
    resume(run)
    assert read_progress(run.path / "progress.csv")[STEPS] == list(range(16, 161, 16))
    assert (run.path / "progress.csv").read_text().count(STEPS) == 1
    events = EventAccumulator(str(run.path / "tensorboard")).Reload()
    assert [event.step for event in events.Scalars(STEPS)] == list(range(16, 161, 16))


def test_where_there_is_no_snapshot_episodes_begin_anew_and_it_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = resume(train_until(100, config(), tmp_path / "run"))
    assert (
        "The resumed run may differ from an uninterrupted run: FrobsTests/Line-v0, stepped one by one, does not "
        "support snapshots" in caplog.text
    )
    assert run.checkpoints[-1].steps == 160
    lengths = read_progress(run.path / "progress.csv")["episode/length"]
    assert {value for value in lengths if value == value} == {10.0}  # none is longer: the sums began anew, too


def test_a_run_without_a_checkpoint_begins_anew(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    whole = train(config(), tmp_path / "whole")
    run = resume(train_until(16, config(), tmp_path / "run"))
    assert "has no checkpoint yet, so the run starts from the beginning" in caplog.text
    assert rows(run) == rows(whole)


def test_a_complete_run_is_left_as_it_is_and_more_steps_extend_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = train(config(), tmp_path / "run")
    before = rows(run)
    assert resume(run.path).path == run.path
    assert "is complete after 160 steps" in caplog.text
    assert rows(run) == before
    longer = resume(run, steps=224)
    assert longer.config.steps == Run.open(run.path).config.steps == 224
    assert rows(longer)[:10] == before
    assert [row[STEPS] for row in rows(longer)[10:]] == ["176", "192", "208", "224"]
    with pytest.raises(ConfigurationError, match="must be at least 224"):
        resume(longer, steps=100)


def test_progress_goes_on_where_it_was(tmp_path: Path) -> None:
    run = train_until(100, config(), tmp_path / "run")
    told: list[Progress] = []
    resume(run, on_progress=told.append)
    assert told[0].steps == 112
    assert told[0].length == 10
    assert told[0].elapsed > read_progress(run.path / "progress.csv")["time/elapsed"][5]


def test_a_damaged_newest_checkpoint_falls_back_to_the_one_before(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    wanted = config(environment="frobs/Irb120Reach-v0", keep_checkpoints=1)
    whole = train(wanted, tmp_path / "whole")
    run = train_until(110, wanted.model_copy(update={"keep_checkpoints": 2}), tmp_path / "run")
    (run.checkpoints[-1].path / "algorithm" / "policy.pt").write_bytes(b"x")
    resumed = resume(run)
    assert "policy.pt is damaged" in caplog.text
    assert "The run continues from step 64" in caplog.text
    assert (run.path / "checkpoints" / "damaged_step_000000096").is_dir()
    assert rows(resumed) == rows(whole)
    assert state(resumed) == state(whole)


def test_where_all_are_damaged_it_is_an_error(tmp_path: Path) -> None:
    run = train_until(50, config(), tmp_path / "run")
    (run.checkpoints[-1].path / "run.json").write_text("{}")
    with pytest.raises(CheckpointError, match=r"no usable checkpoint: .*run\.json is damaged"):
        resume(run)


@pytest.mark.parametrize("damage", ["cut", "flip"])
def test_a_checkpoint_damaged_at_any_byte_is_never_taken(damage: str, tmp_path: Path) -> None:
    run = train_until(100, config(environment="frobs/Irb120Reach-v0", algorithm_config=NORMAL), tmp_path / "run")
    newest = run.checkpoints[-1]
    rng = random.Random(0)
    for path in [path for path in sorted(newest.path.rglob("*")) if path.is_file()]:
        data = path.read_bytes()
        for _ in range(20):
            place = rng.randrange(len(data) - 1)
            changed = bytearray(data[:place] if damage == "cut" else data)
            if damage == "flip":
                changed[place] ^= 1 << rng.randrange(8)
            path.write_bytes(changed)
            if path.name == "checksums.json" and _reads_the_same(data, bytes(changed)):
                continue
            found, damaged = run.newest_checkpoint()
            assert found.steps == 64, (path, place)
            assert "step_000000096" in damaged[0]
        path.write_bytes(data)
    assert run.newest_checkpoint()[0].steps == 96


def _reads_the_same(data: bytes, changed: bytes) -> bool:
    """Tell whether only white space of the JSON has changed."""
    import json

    try:
        return bool(json.loads(data) == json.loads(changed))
    except ValueError:
        return False


def test_an_environment_that_does_not_fit_the_checkpoint_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    run = train_until(50, config(environment="frobs/Irb120Reach-v0"), tmp_path / "run")
    checkpoint = run.checkpoints[-1].path
    other = tmp_path / "other"
    train_until(50, config(environment="frobs/Irb120Reach-v0", num_envs=3), other)
    shutil.copy(Run.open(other).checkpoints[-1].path / "environment.npz", checkpoint)
    from frobs_train.runs.checksums import write_checksums

    write_checksums(
        checkpoint, [path for path in checkpoint.rglob("*") if path.is_file() and path.name != "checksums.json"]
    )
    with pytest.raises(CheckpointError, match="does not fit the environment"):
        resume(run)
    # The state of another version need not fit: new episodes begin, and the algorithm continues.
    path = run.path / "versions.json"
    path.write_text(path.read_text().replace('"frobs-core": "', '"frobs-core": "0.0.'))
    resume(run)
    assert "saved by another version of FRobs; new episodes begin" in caplog.text


def test_other_versions_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    run = train_until(50, config(), tmp_path / "run")
    path = run.path / "versions.json"
    path.write_text(path.read_text().replace('"frobs-core": "', '"frobs-core": "0.0.'))
    resume(run)
    assert "frobs-core was 0.0." in caplog.text


def test_an_existing_folder_is_an_error_or_counted_or_replaced_or_continued(tmp_path: Path) -> None:
    path = tmp_path / "run"
    train_until(50, config(), path)
    (path / "old").touch()
    with pytest.raises(RunExistsError, match="--on-existing"):
        train(config(), path)
    assert train(config(steps=16), path, on_existing="increment").path == tmp_path / "run_2"
    assert train(config(steps=16), path, on_existing="increment").path == tmp_path / "run_3"
    with pytest.raises(RunError, match=r"a different configuration \(seed is 0 instead of 1\)"):
        train(config(seed=1), path, on_existing="resume")
    assert train(config(), path, on_existing="resume").checkpoints[-1].steps == 160
    assert train(config(steps=176), path, on_existing="resume").checkpoints[-1].steps == 176
    assert (path / "old").exists()
    with pytest.raises(ConfigurationError, match="cannot be built"):
        train(config(environment_kwargs={"wdth": 1}), path, on_existing="overwrite")
    assert (path / "old").exists()  # bad input removes nothing
    assert train(config(steps=16), path, on_existing="overwrite").checkpoints[-1].steps == 16
    assert not (path / "old").exists()
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("what", ["overwrite", "resume"])
def test_what_is_no_run_is_neither_removed_nor_continued(what: str, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(RunError, match="is not a run"):
        train(config(), tmp_path, on_existing=what)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_folder_that_is_not_there_is_made_whatever_is_to_be_done(tmp_path: Path) -> None:
    for what in ("increment", "overwrite", "resume"):
        assert train(config(steps=16), tmp_path / what, on_existing=what).path == tmp_path / what
    with pytest.raises(ConfigurationError, match="did you mean 'resume'"):
        train(config(), tmp_path / "x", on_existing="resum")


def test_a_copied_run_continues(tmp_path: Path) -> None:
    run = train_until(100, config(), tmp_path / "run")
    shutil.copytree(run.path, tmp_path / "copy")
    assert resume(tmp_path / "copy").checkpoints[-1].steps == 160
    assert evaluate(Run.open(tmp_path / "copy"), 4, checkpoint=128).steps == 128
