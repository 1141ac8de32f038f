"""The reverse curriculum: training episodes that begin on the path of an expert."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ConfigurationError, RunError
from frobs_train import Progress, Run, RunConfig, resolve_config, resume, train
from frobs_train.environments import make_vector_env
from frobs_train.logs.progress import read_rows
from frobs_train.logs.recorder import FROM_PATH
from frobs_train.training.reverse_curriculum import ReverseCurriculum
from frobs_train.training.session import make_training_env

LIFT = "frobs/PandaLift-v0"
RANDOMIZED = {"size": {"target": "cube", "scale": [0.8, 1.2]}, "action_delay": {"steps": 1}}


class Killed(BaseException):
    """Stands for a kill: nothing catches it."""


@contextmanager
def curriculum(num_envs: Any = 4, environment: str = LIFT, **changes: Any) -> Iterator[ReverseCurriculum]:
    config = RunConfig(**{"environment": environment, "num_envs": num_envs, "seed": 0, "reset_from": {}, **changes})
    with closing(make_training_env(config)) as env:
        assert isinstance(env, ReverseCurriculum)
        yield env


def without_random(snapshot: Any) -> dict[str, np.ndarray[Any, Any]]:
    """Return what must be equal; Bullet writes the same state in other bytes."""
    return {name: rows for name, rows in snapshot.items() if not name.startswith(("random/", "simulation/bullet"))}


@pytest.mark.parametrize("simulator", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
def test_rows_of_a_snapshot_continue_in_other_environments(simulator: str) -> None:
    keywords = {"simulator": simulator, **({"randomize": RANDOMIZED} if simulator == "mujoco" else {})}
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (16, 4, 4))
    with closing(make_vector_env(LIFT, 4, keywords)) as env:
        base = env.unwrapped
        assert isinstance(base, RobotVectorEnv)
        env.reset(seed=0)
        for action in actions[:8]:
            env.step(action)
        early = base.snapshot()
        for action in actions[8:12]:
            env.step(action)
        before = base.snapshot()
        base.restore_rows(np.array([True, False, False, True]), early, np.array([2, 1]))
        after = base.snapshot()
        assert {name: rows.shape for name, rows in after.items()} == {name: rows.shape for name, rows in before.items()}
        for name, rows in without_random(after).items():
            np.testing.assert_array_equal(
                rows, [early[name][2], before[name][1], before[name][2], early[name][1]], name
            )
        np.testing.assert_array_equal(after["random/seeds"], before["random/seeds"])
        continued = [env.step(action)[0] for action in actions[12:]]
        base.restore(before)
        untouched = [env.step(action)[0] for action in actions[12:]]
        for changed, same in zip(continued, untouched, strict=True):
            assert (changed[[0, 3]] != same[[0, 3]]).any(axis=1).all()
            if simulator == "mujoco":  # which continues exactly
                np.testing.assert_array_equal(changed[1:3], same[1:3])


def test_all_episodes_begin_on_the_path_and_observe_what_is_there() -> None:
    with curriculum(reset_from={"share": 1.0, "states": 4}) as env:
        observation, _ = env.reset(seed=3)
        base = env.unwrapped
        assert isinstance(base, RobotVectorEnv)
        task: Any = base.task
        last = base.max_episode_steps - 1
        assert (base.snapshot()["elapsed"] == last).all()  # the front is at the end of the path
        height = task.cube.pos[:, 2]
        assert (height > 0.1).all()  # the expert has lifted the cube
        _, _, _, truncated, info = env.step(np.zeros((4, 4)))
        assert truncated.all()
        assert info["final_info"][FROM_PATH].all()
        assert info["final_info"]["is_success"].all()
        np.testing.assert_array_less(0.1, task.cube.pos[:, 2])
        assert observation.shape == env.observation_space.shape


def test_the_share_of_the_steps_and_the_front_are_as_stated() -> None:
    with curriculum(64, reset_from={"share": 0.5, "states": 5}) as env:
        env.reset(seed=0)
        # At the end of the path, episodes are a fifth as long: 5 of 6 begin there for half of the steps.
        assert 44 <= int((env.snapshot()["state"] >= 0).sum()) <= 61
        (part,) = env.curricula
        assert part.front == 4
        for _ in range(3):  # one step is left to those on the path: doing nothing is a success
            env.step(np.zeros((64, 4)))
        assert part.front < 4
        assert env.metrics() == {"curriculum/front": part.front / 4}
        front = part.front
        for _ in range(100):  # the cube falls
            env.step(np.tile([0.0, 0.0, 0.0, 1.0], (64, 1)))
        assert 0 < part.front <= front


@pytest.mark.needs("pybullet")
def test_each_simulator_has_its_own_front() -> None:
    with curriculum(
        environment="frobs/PandaPush-v0", num_envs={"mujoco": 8, "pybullet": 2}, reset_from={"share": 1.0}
    ) as env:
        mujoco, pybullet = env.curricula
        env.reset(seed=0)
        assert (env.unwrapped.parts["pybullet"].snapshot()["elapsed"] > 0).all()  # type: ignore[attr-defined]
        mujoco.count(np.ones(50))
        assert (mujoco.front, pybullet.front) == (23, 24)
        assert env.metrics() == pytest.approx({"curriculum/front": 23.5 / 24})
        before = env.snapshot()
        mujoco.count(np.ones(50))
        env.restore(before)
        assert (mujoco.front, pybullet.front) == (23, 24)
        info: dict[str, Any] = {}
        while "final_info" not in info:
            info = env.step(np.zeros((10, 4)))[-1]
        assert info["final_info"][FROM_PATH].shape == (10,)


def test_statistics_leave_out_the_episodes_on_the_path(tmp_path: Path) -> None:
    run = train(configuration(steps=75 * 8, reset_from={"share": 0.5}), tmp_path / "run")
    rows = read_rows(run.path / "progress.csv")
    assert {float(row["episode/length"]) for row in rows if row["episode/length"]} == {75.0}
    assert {float(row["curriculum/front"]) for row in rows} <= set(np.linspace(0.0, 1.0, 25).tolist())


def configuration(**changes: Any) -> RunConfig:
    algorithm = {"n_steps": 10, "batch_size": 40, "n_epochs": 1, "policy_kwargs": {"net_arch": [8]}}
    values = {
        "environment": LIFT,
        "num_envs": 8,
        "seed": 0,
        "algorithm_config": algorithm,
        "log_every": 1,
        "steps": 800,
    }
    return RunConfig(**{**values, "checkpoint_every": 240, **changes})


@pytest.mark.slow
def test_a_continued_run_equals_one_that_never_stopped(tmp_path: Path) -> None:
    def on_progress(progress: Progress) -> None:
        if progress.steps >= 500:
            raise Killed

    wanted = configuration(reset_from={"share": 0.7, "success": 0.3}, randomize=RANDOMIZED)
    whole = train(wanted, tmp_path / "whole")
    with pytest.raises(Killed):
        train(wanted, tmp_path / "killed", on_progress)
    resumed = resume(Run.open(tmp_path / "killed"))
    assert logged(resumed) == logged(whole)


def logged(run: Run) -> list[dict[str, str]]:
    rows = read_rows(run.path / "progress.csv")
    return [{key: value for key, value in row.items() if not key.startswith("time/")} for row in rows]


@pytest.mark.parametrize(
    ("environment", "keywords", "message"),
    [
        (
            "frobs/Irb120Reach-v0",
            {},
            "needs a task with an expert; to train without reset_from, pass --set reset_from=null",
        ),
        ("CartPole-v1", {}, "reset_from needs a native vector environment of FRobs"),
        (
            LIFT,
            {"mass": 50.0},
            "none of the expert's 2 episodes lasted until the time limit and ended in success",
        ),
        (
            LIFT,
            {"controller": "joint_position", "controller_kwargs": {}},
            "choose 'tcp_delta_pose' for the arm; to train without reset_from, pass --set reset_from=null",
        ),
    ],
)
def test_what_cannot_be_used_is_one_error(environment: str, keywords: dict[str, Any], message: str) -> None:
    with (
        pytest.raises(RunError, match=message),
        curriculum(2, environment, environment_kwargs=keywords),
    ):
        pass


def test_the_expert_acts_for_whole_episodes_where_the_training_is_staggered() -> None:
    with curriculum() as plain, curriculum(stagger=True) as staggered:
        np.testing.assert_array_equal(staggered.curricula[0]._rows, plain.curricula[0]._rows)


def test_a_share_of_zero_is_an_error() -> None:
    with pytest.raises(ConfigurationError, match="share"):
        resolve_config(settings=[f"environment={LIFT}", "reset_from.share=0"])


def test_a_run_may_not_get_another_curriculum_later(tmp_path: Path) -> None:
    run = train(configuration(steps=80), tmp_path / "run")
    with pytest.raises(RunError, match="reset_from"):
        resume(run, steps=160, settings=["reset_from.share=0.5"])


def test_evaluations_begin_as_usual(tmp_path: Path) -> None:
    run = train(
        configuration(steps=80, reset_from={"share": 1.0}, evaluate_every=80, evaluation_episodes=2), tmp_path / "r"
    )
    (row,) = [row for row in read_rows(run.path / "progress.csv") if row.get("evaluation/length")]
    assert float(row["evaluation/length"]) == 75.0
