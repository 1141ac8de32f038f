"""A policy of RLlib acts with frobs-deploy alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_train import resolve_config, train
from frobs_train.environments import make_vector_env
from frobs_train.export.export import export
from frobs_train.runs.policy import load_algorithm

ACT = """
import sys
for name in ("torch", "ray", "stable_baselines3", "gymnasium", "frobs_core", "frobs_train"):
    sys.modules[name] = None  # an import raises ImportError
import numpy as np
from frobs_deploy import Policy
policy = Policy(sys.argv[1])
np.save(sys.argv[3], np.array([policy.act(observation) for observation in np.load(sys.argv[2])]))
"""


@pytest.mark.slow
@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("name", ["rllib_ppo", "rllib_sac", "rllib_appo"])
def test_an_exported_policy_acts_alike(name: str, tmp_path: Path) -> None:
    settings = ["algorithm_config.policy_kwargs.net_arch=[8]"]
    if name != "rllib_sac":
        settings.append("algorithm_config.n_steps=16")
    flags = {"algorithm": name, "num_envs": 4, "steps": 128, "seed": 1}
    run = train(resolve_config("frobs/Irb120Reach-v0", flags=flags, settings=settings), tmp_path / "run")
    exported = export(run, license="MIT")
    env = make_vector_env("frobs/Irb120Reach-v0", 100, {})
    env.action_space.seed(0)
    env.reset(seed=0)
    observations = np.concatenate([env.step(env.action_space.sample())[0] for _ in range(3)])
    env.close()
    np.save(tmp_path / "observations.npy", observations)
    files = [exported.path, tmp_path / "observations.npy", tmp_path / "actions.npy"]
    subprocess.run([sys.executable, "-c", ACT, *map(str, files)], check=True)
    policy, _ = load_algorithm(run, env.single_observation_space, env.single_action_space)
    expected, _ = policy.predict(observations)
    np.testing.assert_allclose(np.load(tmp_path / "actions.npy"), expected, rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("id", ["CartPole-v1", "frobs/Irb120ReachGoal-v0"])
def test_choices_and_dictionaries_are_exported(id: str, make: Any) -> None:
    import onnxruntime

    algorithm = make("rllib_ppo", id=id)
    session = onnxruntime.InferenceSession(algorithm.export_onnx())
    observation = algorithm.env.reset(seed=3)[0]
    parts = observation if isinstance(observation, dict) else {"": observation}
    inputs = {f"observation/{key}" if key else "observation": value for key, value in parts.items()}
    action = session.run(["action"], inputs)[0]
    np.testing.assert_allclose(action, algorithm.predict(observation)[0], rtol=0.0, atol=1e-5)
