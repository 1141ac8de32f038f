"""Policies that see: their bundles say which camera took the images, and act on these as the trainer's policies do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_deploy import Policy, read_bundle, read_manifest
from frobs_train import evaluate, resolve_config, train
from frobs_train.environments import make_vector_env
from frobs_train.export.bundle_run import changes_since, open_run_or_bundle
from frobs_train.export.export import export
from frobs_train.export.export_facts import environment_facts
from frobs_train.runs.policy import load_algorithm

REACH = "frobs/Irb120Reach-v0"
KEYWORDS: dict[str, Any] = {
    "controller": "tcp_delta_position",
    "observations": {"eye": {"camera": "overview", "size": [36, 48], "markers": True}},
}
DEPTH = {"camera": "overview", "size": [40, 36], "modality": "depth"}
STEPS, ENVS = 25, 8


def test_the_record_says_which_camera_takes_each_image() -> None:
    keywords = {**KEYWORDS, "observations": {**KEYWORDS["observations"], "far": DEPTH}}
    config = resolve_config(REACH, flags={"environment_kwargs": keywords})
    env = make_vector_env(REACH, 1, config.environment_kwargs)
    camera = env.unwrapped.simulation.scene.cameras["overview"]  # type: ignore[attr-defined]
    said = environment_facts(env, config)["observation"]
    env.close()
    view = {
        "camera": "overview",
        "frame": None,
        "pos": [*camera.pos],
        "target": [*camera.target],
        "fov_y": camera.fov_y,
    }
    assert said["images"] == {
        "eye": {**view, "modality": "rgb", "markers": True, "unit": "1"},
        "far": {**view, "modality": "depth", "markers": False, "unit": "m"},
    }
    assert said["spaces"]["eye"] == {"type": "Box", "shape": [36, 48, 3], "dtype": "uint8", "low": 0.0, "high": 255.0}
    assert said["spaces"]["far"] == {"type": "Box", "shape": [40, 36, 1], "dtype": "float32", "low": 0.0, "high": None}
    assert said["terms"][0]["name"] == "joint_positions"


@pytest.mark.filterwarnings("ignore:.*precision lowered")  # Gymnasium's, of its own bounds
def test_images_behind_a_wrapper_are_those_of_the_wrapper() -> None:
    wrapper = {"name": "gymnasium.wrappers:FlattenObservation"}
    config = resolve_config(REACH, flags={"environment_kwargs": KEYWORDS, "wrappers": [wrapper]})
    env = make_vector_env(REACH, 1, config.environment_kwargs, config.wrappers)
    said = environment_facts(env, config)["observation"]
    env.close()
    assert (said["images"], said["terms"]) == ({}, [])


@pytest.mark.slow
def test_a_policy_that_sees_acts_alone_as_it_does_where_it_was_trained(tmp_path: Path) -> None:
    settings = ["n_steps=32", "batch_size=64", "n_epochs=4", "learning_rate=1e-3"]
    config = resolve_config(
        REACH,
        flags={"environment_kwargs": KEYWORDS, "num_envs": 4, "steps": 512, "seed": 0},
        settings=[f"algorithm_config.{setting}" for setting in settings],
    )
    run = train(config, tmp_path / "run")
    made = export(run, license="MIT")
    assert made.observations == 256
    assert made.max_difference <= 1e-5
    policy = Policy(made.path)
    assert list(policy.manifest.images) == ["eye"]

    env = make_vector_env(REACH, ENVS, config.environment_kwargs)
    trained, _ = load_algorithm(run, env.single_observation_space, env.single_action_space)
    observation, _ = env.reset(seed=7)
    actions, blind = [], []
    for _ in range(STEPS):
        expected, _ = trained.predict(observation)
        np.testing.assert_allclose(policy.act(observation), expected, atol=1e-5)
        actions.append(expected)
        blind.append(policy.act({**observation, "eye": np.zeros_like(observation["eye"])}))
        observation, *_ = env.step(env.action_space.sample())
    env.close()
    assert np.abs(np.array(actions) - np.array(blind)).max() > 1e-3  # it looks

    bundle = open_run_or_bundle(made.path)
    assert evaluate(bundle, 8).mean_reward == pytest.approx(evaluate(run, 8).mean_reward, rel=1e-4)
    assert changes_since(bundle) == []  # type: ignore[arg-type]
    assert read_manifest(read_bundle(made.path)).observation["eye"].shape == (36, 48, 3)
