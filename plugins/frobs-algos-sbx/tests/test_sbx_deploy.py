"""A policy that was trained in JAX acts with frobs-deploy alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from frobs_train import resolve_config, train
from frobs_train.environments import make_vector_env
from frobs_train.export.export import export
from frobs_train.runs.policy import load_algorithm

ACT = """
import sys
for name in ("torch", "jax", "flax", "sbx", "stable_baselines3", "gymnasium", "frobs_core", "frobs_train"):
    sys.modules[name] = None  # an import raises ImportError
import numpy as np
from frobs_deploy import Policy
policy = Policy(sys.argv[1])
np.save(sys.argv[3], np.array([policy.act(observation) for observation in np.load(sys.argv[2])]))
"""


@pytest.mark.slow
def test_an_exported_policy_acts_alike_on_a_thousand_observations(tmp_path: Path) -> None:
    settings = ["algorithm_config.learning_starts=32", "algorithm_config.policy_kwargs.net_arch=[8]"]
    config = resolve_config(
        "frobs/Irb120Reach-v0", flags={"algorithm": "sbx_sac", "num_envs": 4, "steps": 64, "seed": 1}, settings=settings
    )
    run = train(config, tmp_path / "run")
    exported = export(run, license="MIT")
    env = make_vector_env(config.environment, 200, {})
    env.action_space.seed(0)
    env.reset(seed=0)
    observations = np.concatenate([env.step(env.action_space.sample())[0] for _ in range(5)])
    env.close()
    np.save(tmp_path / "observations.npy", observations)
    files = [exported.path, tmp_path / "observations.npy", tmp_path / "actions.npy"]
    subprocess.run([sys.executable, "-c", ACT, *map(str, files)], check=True)
    policy, _ = load_algorithm(run, env.single_observation_space, env.single_action_space)
    expected, _ = policy.predict(observations)
    np.testing.assert_allclose(np.load(tmp_path / "actions.npy"), expected, rtol=0.0, atol=1e-5)
