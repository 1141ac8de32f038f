"""Observation terms that are read outside the observation."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.plugins import get_record
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.errors import CapabilityError, ConfigurationError, UnknownNameError

PARTS: dict[str, Any] = {"task": "reach", "robot": "irb120", "controller": "joint_delta_position"}
NOISY = {"sensors": {"hand": {"type": "imu", "frame": "link_6", "noise": 0.5, "dropout": 0.2}}}
HAND = {"hand": {"type": "sensor", "sensor": "hand"}}
STATE = {"efforts": {"type": "joint_efforts"}, "last": {"type": "previous_action"}, "tool": {"type": "tcp_pose"}}
EYE = {"eye": {"camera": "overview", "size": [24, 32]}, "far": {"camera": "overview", "modality": "depth"}}


def test_terms_are_what_the_observation_would_contain() -> None:
    with closing(RobotVectorEnv(3, **PARTS)) as env, closing(RobotVectorEnv(3, observations=STATE, **PARTS)) as other:
        for each in (env, other):
            each.reset(seed=0)
        for action in np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3, 6)):
            (plain, *_), (observation, *_) = env.step(action), other.step(action)
            terms = env.read_terms(STATE)
            assert list(terms) == list(STATE)
            assert {values.dtype for values in terms.values()} == {np.dtype(np.float32)}
            assert (np.concatenate([plain, *terms.values()], axis=1) == observation).all()
        assert env.single_observation_space.shape == plain[0].shape


def test_single_environment_reads_single_rows() -> None:
    with closing(RobotEnv(**PARTS)) as env:
        env.reset(seed=0)
        assert {name: values.shape for name, values in env.read_terms(STATE).items()} == {
            "efforts": (6,),
            "last": (6,),
            "tool": (7,),
        }


@pytest.mark.needs("rendering")
def test_cameras_are_read_without_a_term_of_the_observation() -> None:
    with closing(RobotEnv(**PARTS)) as env, closing(RobotEnv(observations=EYE, **PARTS)) as other:
        observation = other.reset(seed=0)[0]
        env.reset(seed=0)
        env.read_terms(EYE)  # MuJoCo's first image may differ by rounding, and the other environment has rendered one
        for name, picture in env.read_terms(EYE).items():
            assert picture.dtype == observation[name].dtype
            assert (picture == observation[name]).all()


def test_noisy_sensor_does_not_change_the_numbers_of_the_observation() -> None:
    def trajectory(read: bool) -> list[np.ndarray[Any, Any]]:
        keywords = {**PARTS, **NOISY, "observations": HAND, "max_episode_steps": 4}
        with closing(RobotVectorEnv(3, stagger=True, **keywords)) as env:
            seen = [env.reset(seed=0)[0]]
            for step, action in enumerate(np.random.default_rng(0).uniform(-1.0, 1.0, (10, 3, 6))):
                if read and step != 5:
                    env.read_terms(HAND)
                seen.append(env.step(action)[0])
            return seen

    assert (np.array(trajectory(True)) == np.array(trajectory(False))).all()


def test_sensor_is_current_after_a_restored_snapshot() -> None:
    calm = {"sensors": {"hand": {"type": "imu", "frame": "link_6"}}}
    with closing(RobotEnv(**PARTS, **calm)) as env:
        env.reset(seed=0)
        before, snapshot = env.read_terms(HAND)["hand"], env.snapshot()
        env.step(np.ones(6))
        assert abs(env.read_terms(HAND)["hand"] - before).max() > 0.1
        env.restore(snapshot)
        assert env.read_terms(HAND)["hand"] == pytest.approx(before)


def test_last_frame_is_there_before_an_autoreset() -> None:
    tool = {"tool": {"type": "tcp_pose"}}
    with closing(RobotVectorEnv(2, max_episode_steps=3, **PARTS)) as env:
        frames: list[np.ndarray[Any, Any]] = []
        env.before_autoreset.append(lambda mask: frames.append(env.read_terms(tool)["tool"][mask]))
        env.reset(seed=0)
        for _ in range(3):
            *_, info = env.step(np.ones((2, 6)))
        ((last, _),) = frames
        columns = env.observations.columns["tcp_position"][1]
        assert last[:3] == pytest.approx(info["final_obs"][0][columns], abs=1e-6)


def test_wrong_settings_are_named() -> None:
    mujoco = get_record("simulator", "mujoco")
    assert isinstance(mujoco, SimulatorRecord)
    levels = {name: level for name, level in mujoco.capabilities.items() if name != "cameras"}
    with closing(RobotEnv(simulator=replace(mujoco, capabilities=levels), **PARTS)) as env:
        with pytest.raises(UnknownNameError, match="type of the observation term 'x' is named 'joint_position'"):
            env.read_terms({"x": {"type": "joint_position"}})
        with pytest.raises(UnknownNameError, match="body of the observation term 'x' is named 'cube'"):
            env.read_terms({"x": {"type": "body", "body": "cube"}})
        with pytest.raises(ConfigurationError, match="'goal' is None"):
            env.read_terms({"goal": None})
        with pytest.raises(CapabilityError, match=r"observations\.eye"):
            env.read_terms({"eye": {"camera": "overview"}})
