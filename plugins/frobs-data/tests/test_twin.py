"""Delay, jitter, noise and gains of recorded robots are identified, or reported as unknown."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

import frobs_data
from frobs_cli.program import program
from frobs_data import DataError, DatasetWriter, Feature, identify
from frobs_data.recorded_features import ACTION, SEED, Vectors
from frobs_train import resolve_config

REACH = "frobs/Irb120Reach-v0"
STEPS, MAX_DELAY = 90, 5
NOISE = {"joint_positions": {"normal": 0.002}, "tcp_position": {"normal": 0.004}}


def record(folder: Path, randomize: Mapping[str, Any], amplitude: float = 0.5, episodes: int = 2, **more: Any) -> Path:
    """Record sine motions of a simulated robot whose parameters are known."""
    env: Any = gym.make(f"frobs_core:{REACH}", randomize=randomize, max_episode_steps=1000, **more).unwrapped
    vectors, rng = Vectors(env.observations), np.random.default_rng(0)
    features = {**vectors.features, ACTION: Feature("float32", (6,)), SEED: Feature("int64", (1,))}
    facts = {"environment": REACH, "environment_kwargs": more, "simulator": "mujoco"}
    with DatasetWriter(folder, 25, features, env.robot.robot.name, facts) as writer:
        for episode in range(episodes):
            observation, _ = env.reset(seed=episode)
            frequencies, phases = rng.uniform(0.1, 0.5, 6), rng.uniform(0.0, 6.0, 6)
            rows = []
            for step in range(STEPS):
                action = (amplitude * np.sin(frequencies * step + phases)).astype(np.float32)
                rows.append({name: value[0] for name, value in vectors.read(observation[None]).items()})
                rows[-1] |= {ACTION: action, SEED: episode}
                observation = env.step(action)[0]
            writer.add({name: np.stack([row[name] for row in rows]) for name in rows[0]}, "Move.")
    env.close()
    return folder


@pytest.mark.slow
def test_a_known_delay_noise_and_gains_are_found(tmp_path: Path) -> None:
    known = {"stiffness": {"scale": 0.7}, "damping": {"scale": 1.3}, "action_delay": {"steps": 2}}
    found = identify(record(tmp_path / "data", {**known, "observation_noise": NOISE}), max_delay=MAX_DELAY)
    assert found.problems == ()
    assert [each.value for each in found.delays] == pytest.approx([2.0, 2.0], abs=0.1)
    assert found.jitter == 0.0
    assert found.noise == {
        "joint_positions": pytest.approx(0.002, rel=0.1),
        "tcp_position": pytest.approx(0.004, rel=0.1),
    }
    for name, each in found.gains.items():
        true = 0.7 if name.startswith("stiffness") else 1.3
        assert each.value == pytest.approx(true, rel=max(0.1, 3.0 * each.error)), name
    assert found.tracking_error == pytest.approx(0.002, rel=0.15)
    block = found.block()
    assert block["action_delay"] == {"steps": 2}
    assert "observation_delay" not in block
    _is_accepted(block, tmp_path)


@pytest.mark.slow
def test_delays_of_episodes_and_jitter_are_found(tmp_path: Path) -> None:
    """The delay of the actions is drawn per episode, and that of the observation at each step."""
    late = {"action_delay": {"steps": [0, 3]}, "observation_delay": {"steps": [0, 2], "when": "step"}}
    folder = record(
        tmp_path / "data", {**late, "observation_noise": {"joint_positions": {"normal": 0.001}}}, episodes=3
    )
    env: Any = gym.make(f"frobs_core:{REACH}", randomize=late)
    true = [float(env.reset(seed=i)[1]["frobs/randomization"]["action_delay"]) for i in range(3)]
    env.close()
    assert len(set(true)) > 1
    found = identify(folder, max_delay=6)
    assert [each.value for each in found.delays] == pytest.approx([delay + 1.0 for delay in true], abs=0.3)
    assert found.jitter == pytest.approx(np.sqrt(2.0 / 3.0), rel=0.15)
    block = found.block()
    assert block["observation_delay"] == {"steps": [0, 2], "when": "step"}
    assert block["action_delay"] == {"steps": [min(true), max(true)]}
    _is_accepted(block, tmp_path)


def _is_accepted(block: dict[str, Any], folder: Path) -> None:
    from frobs_core.util.yaml import dump_yaml, load_yaml

    (folder / "twin.yaml").write_text(dump_yaml({"randomize": block}))
    config = resolve_config(REACH, file=folder / "twin.yaml")
    assert config.randomize == load_yaml(folder / "twin.yaml")["randomize"]
    env = gym.make(f"frobs_core:{REACH}", randomize=config.randomize)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.close()


def test_a_robot_that_does_not_move_is_not_identified(tmp_path: Path) -> None:
    folder = record(tmp_path / "data", {"observation_noise": NOISE}, amplitude=0.0, episodes=1)
    arguments = ["data", "twin", str(folder), "--max-delay", str(MAX_DELAY), "--out", str(tmp_path / "twin.yaml")]
    result = CliRunner().invoke(program(), arguments, catch_exceptions=False)
    assert "not identified: delay: record a motion" in result.output
    assert "joint_6: it moves by less than 0.02" in result.output
    assert "\nrandomize:\n  observation_noise:\n    joint_positions:\n" in result.output
    text = (tmp_path / "twin.yaml").read_text()
    assert "joint_positions" in text
    assert not any(name in text for name in ("delay", "stiffness", "damping"))


def test_a_joint_without_motion_is_not_identified_and_others_are(tmp_path: Path) -> None:
    amplitude: Any = np.array([0.5, 0.5, 0.5, 0.5, 0.5, 0.0])
    folder = record(
        tmp_path / "data", {"action_delay": {"steps": 1}, "observation_noise": NOISE}, amplitude, episodes=1
    )
    found = identify(folder, max_delay=3)
    assert {name for name in found.gains if name.endswith("joint_6")} == set()
    assert "damping/joint_3" in found.gains
    assert any(problem.startswith("joint_6: it moves by less") for problem in found.problems)
    assert found.delays[0].value == pytest.approx(1.0, abs=0.15)


def test_a_data_set_that_does_not_fit_is_one_clear_error(tmp_path: Path) -> None:
    folder = record(tmp_path / "short", {}, episodes=1)
    with pytest.raises(DataError, match="no episode has more than 100 frames; record longer episodes"):
        identify(folder, max_delay=90)
    frobs_data.record("frobs/PandaLift-v0", "random", episodes=1, out=tmp_path / "lift")
    with pytest.raises(DataError, match="does not observe the positions of all joints; record it with --set"):
        identify(tmp_path / "lift")
