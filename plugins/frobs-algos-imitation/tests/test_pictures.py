"""Policies that see: what the encoder learns, augmentation, memory, export and exact resume."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th

from frobs_algos_imitation.bc import BC
from frobs_algos_imitation.dagger import Dagger
from frobs_algos_imitation.pictures import augmented
from frobs_algos_imitation.samples import Samples
from frobs_core.util.errors import IncompatibleSpaceError
from frobs_train import Progress, Run, resolve_config, resume, train

SIDE = 32
SEEING = gym.spaces.Dict(
    {
        "eye": gym.spaces.Box(0, 255, (SIDE, SIDE, 3), np.uint8),
        "observation": gym.spaces.Box(-9.0, 9.0, (2,), np.float32),
    }
)
ACTION = gym.spaces.Box(np.float32([-1.0, -2.0]), np.float32([1.0, 6.0]))


class Spaces:
    """The spaces of an environment."""

    num_envs = 1

    def __init__(self, observation: gym.Space[Any]) -> None:
        self.single_observation_space, self.single_action_space = observation, ACTION


def untrained(cls: Any, observation: gym.Space[Any], config: dict[str, Any]) -> Any:
    """Return an algorithm without demonstrations."""
    algorithm = cls.__new__(cls)
    algorithm._build(Spaces(observation), cls.resolve_config(config), 0, None)
    return algorithm


def dots(n: int, seed: int) -> tuple[dict[str, Any], Any]:
    """Return observations, each with a red square somewhere on noise, and the place of the square in [−1, 1]."""
    rng = np.random.default_rng(seed)
    eye = rng.integers(0, 120, (n, SIDE, SIDE, 3), np.uint8)
    places = rng.integers(4, SIDE - 8, (n, 2))
    for picture, (row, column) in zip(eye, places, strict=True):
        picture[row : row + 4, column : column + 4] = 255, 30, 30
    vector = rng.normal(size=(n, 2)).astype(np.float32)
    return {"eye": eye, "observation": vector}, 2.0 * (places + 2.0) / SIDE - 1.0


def test_a_policy_learns_where_something_is_in_a_picture() -> None:
    algorithm = untrained(BC, SEEING, {"net_arch": [64], "batch_size": 64, "learning_rate": 2e-3})
    (observation, places), (new, new_places) = dots(800, 0), dots(200, 1)
    label = (ACTION.low + (places + 1.0) * 0.5 * (ACTION.high - ACTION.low)).astype(np.float32)
    frames, seen = algorithm.policy.split(observation)
    algorithm.samples = Samples.of(frames, None, label, np.arange(800) % 10 == 0, pictures=seen)
    algorithm.policy.normalize(algorithm.samples.frames)
    for index in range(300):
        algorithm._update(index / 300)
    action, _ = algorithm.predict(new)
    found = 2.0 * (action - ACTION.low) / (ACTION.high - ACTION.low) - 1.0
    assert np.abs(found - new_places).mean() < 0.1  # a quarter of the square's way without looking
    blind, _ = algorithm.predict({**new, "eye": np.zeros_like(new["eye"])})
    assert np.abs(blind - action).mean() > 0.2


def test_pictures_are_shifted_and_colored_each_in_its_own_way() -> None:
    generator = th.Generator().manual_seed(0)
    picture = th.arange(SIDE * SIDE * 3, dtype=th.int64).remainder(251).to(th.uint8).reshape(1, SIDE, SIDE, 3)
    same = augmented(picture.repeat(2, 1, 1, 1), 0, 0.0, generator)
    assert th.equal(same[0], picture[0].permute(2, 0, 1) / 255.0 - 0.5)
    shifted = (augmented(picture.repeat(64, 1, 1, 1), 2, 0.0, generator) + 0.5) * 255.0
    found = set()
    for one in shifted.round().permute(0, 2, 3, 1):
        moves = [
            (row, column)
            for row in range(-2, 3)
            for column in range(-2, 3)
            if th.equal(one[2:-2, 2:-2], picture[0, 2 + row : SIDE - 2 + row, 2 + column : SIDE - 2 + column].float())
        ]
        assert len(moves) == 1
        found.update(moves)
    assert len(found) > 15
    colored = augmented(th.full((50, 4, 4, 3), 100, dtype=th.uint8), 0, 0.2, generator)
    assert colored.std(dim=0).min() > 0.01
    assert (colored[:, :, 0, 0] == colored[:, :, 3, 3]).all()  # the whole picture alike


def test_each_picture_is_in_memory_once() -> None:
    parts = [
        Samples.of(
            np.zeros((5, 1), np.float32),
            None,
            np.zeros((5, 2)),
            np.arange(5) == 0,
            pictures={"eye": dots(5, seed)[0]["eye"]},
        )
        for seed in (0, 1)
    ]
    both = parts[0] + parts[1]
    assert [one.data_ptr() for one in both._pictures[0]] == [part._pictures[0][0].data_ptr() for part in parts]
    [seen] = both.pictures(th.tensor([7, 0, 9]))
    expected = [dots(5, 1)[0]["eye"][2], dots(5, 0)[0]["eye"][0], dots(5, 1)[0]["eye"][4]]
    np.testing.assert_array_equal(seen.numpy(), expected)


@pytest.mark.parametrize("size", [(16, 64), (64, 8)])
def test_small_pictures_are_rejected(size: tuple[int, int]) -> None:
    space = gym.spaces.Dict({"eye": gym.spaces.Box(0, 255, (*size, 3), np.uint8)})
    with pytest.raises(IncompatibleSpaceError, match="at least 20 x 20"):
        untrained(BC, space, {})


def test_depth_is_rejected() -> None:
    space = gym.spaces.Dict({"depth": gym.spaces.Box(0.0, np.inf, (32, 32, 1), np.float32)})
    with pytest.raises(IncompatibleSpaceError, match="color pictures"):
        untrained(BC, space, {})


@pytest.mark.slow
@pytest.mark.parametrize("history", [1, 3])
@pytest.mark.parametrize("observation", [SEEING, gym.spaces.Dict({"eye": SEEING["eye"]}), SEEING["eye"]])
def test_the_graph_sees_as_the_policy(history: int, observation: gym.Space[Any]) -> None:
    import onnxruntime

    algorithm = untrained(Dagger, observation, {"history": history, "net_arch": [16]})
    session = onnxruntime.InferenceSession(algorithm.export_onnx(), providers=["CPUExecutionProvider"])
    shapes = algorithm.policy.state_shapes
    state, carried = None, [np.zeros((3, *shape), np.float32) for shape in shapes]
    for step in range(4):
        start = np.full(3, step == 0)
        parts = dots(3, step)[0]
        given: Any = parts["eye"] if isinstance(observation, gym.spaces.Box) else parts
        action, state = algorithm.predict(given, state, start)
        keys = [""] if isinstance(observation, gym.spaces.Box) else list(observation.spaces)  # type: ignore[attr-defined]
        inputs = {f"observation/{key}" if key else "observation": parts[key or "eye"] for key in keys}
        inputs |= {f"state/{i}": part for i, part in enumerate(carried)} | ({"episode_start": start} if shapes else {})
        found, *carried = session.run(None, inputs)
        np.testing.assert_allclose(found, action, atol=1e-5)


class Killed(BaseException):
    """Stands for a kill: nothing catches it, and nothing is written after it."""


@pytest.mark.slow
@pytest.mark.needs("rendering")
def test_an_interrupted_run_that_sees_equals_an_uninterrupted_one(tmp_path: Path) -> None:
    eye = "{camera: overview, size: [24, 24]}"
    settings = [
        f"environment_kwargs.observations={{cube_position: null, cube_offset: null, eye: {eye}}}",
        *("algorithm_config.net_arch=[16]", "algorithm_config.updates=4", "algorithm_config.final_updates=6"),
        *("algorithm_config.history=2", "algorithm_config.batch_size=16", "algorithm_config.image_color=0.1"),
        "log_every=1",
    ]

    def config(*more: str) -> Any:
        flags = {"algorithm": "dagger", "steps": 3 * 2 * 75, "num_envs": 2, "seed": 3}
        return resolve_config("frobs/PandaLift-v0", flags=flags, settings=[*settings, *more])

    def weights(run: Run) -> dict[str, th.Tensor]:
        return th.load(run.newest_checkpoint()[0].path / "algorithm" / "policy.pt", weights_only=True)

    def kill(progress: Progress) -> None:
        if progress.steps > 150:
            raise Killed

    whole = weights(train(config(), tmp_path / "whole"))
    with pytest.raises(Killed):
        train(config("checkpoint_every=150"), tmp_path / "cut", kill)
    again = weights(resume(Run.open(tmp_path / "cut")))
    assert any(name.startswith("eyes.") for name in whole)
    for name, value in whole.items():
        assert th.equal(value, again[name]), name
