"""Data sets as arrays in the layout of an environment."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.util import memory
from frobs_core.util.errors import ConfigurationError
from frobs_data import DataError, DatasetWriter, Feature, training_arrays
from frobs_train.configuration.config import ComponentConfig
from frobs_train.environments import make_vector_env

REACH = "frobs/Irb120Reach-v0"


def names_of(env: Any, terms: list[str]) -> tuple[str, ...]:
    sizes = {name: len(env.unwrapped.observations.terms[name].low) for name in terms}
    return tuple(f"{name}_{i}" if size > 1 else name for name, size in sizes.items() for i in range(size))


def record(
    folder: Path,
    env: Any,
    more: dict[str, Feature],
    fps: int = 25,
    robot: str | None = None,
    scale: float = 1.0,
) -> dict[str, Any]:
    """Write two episodes with random numbers, and return their columns."""
    base = env.unwrapped
    terms = list(base.observations.terms)
    state, rest = names_of(env, terms[:2]), names_of(env, terms[:1:-1])
    features = {
        "observation.state": Feature("float32", (len(state),), state),
        "observation.environment_state": Feature("float32", (len(rest),), rest),
        "action": Feature("float32", (base.action_space.shape[-1],)),
        **{name: Feature("bool", (1,)) for name in ("next.success", "next.terminated")},
        "next.reward": Feature("float32", (1,)),
        **more,
    }
    rng = np.random.default_rng(0)
    columns: dict[str, list[Any]] = {name: [] for name in features}
    with DatasetWriter(folder, fps, features, robot or base.robot.robot.name, codec="libx264") as writer:
        for length in (4, 6):
            episode = {
                name: rng.integers(0, 255, (length, *feature.shape)).astype(np.uint8)
                if feature.is_video
                else (rng.random((length, *feature.shape)) > 0.5).astype(feature.dtype)
                if feature.dtype == "bool"
                else (rng.random((length, *feature.shape)) * (scale if name == "action" else 1.0)).astype(np.float32)
                for name, feature in features.items()
            }
            writer.add(episode, "Reach.")
            for name, values in episode.items():
                columns[name].append(values)
    return {name: np.concatenate(parts) for name, parts in columns.items()}


def test_terms_are_found_by_name(make: Callable[..., Any], tmp_path: Path) -> None:
    for num_envs in (None, 2, {"mujoco": 2}):
        env = make(REACH, num_envs)
        given = record(tmp_path / str(num_envs), make(REACH), {})
        found = training_arrays(tmp_path / str(num_envs), env)
        base = env.unwrapped
        for name, (_, columns) in base.observations.columns.items():
            start = (
                names_of(env, list(base.observations.terms)[:2]).index(f"{name}_0")
                if name in ("joint_positions", "tcp_position")
                else -1
            )
            if start >= 0:
                size = columns.stop - columns.start
                expected = given["observation.state"][:, start : start + size]
                np.testing.assert_array_equal(found["observation"][:, columns], expected)
        goal = base.observations.columns["goal"][1]
        place = names_of(env, list(base.observations.terms)[:1:-1]).index("goal_0")
        expected = given["observation.environment_state"][:, place : place + 3]
        np.testing.assert_array_equal(found["observation"][:, goal], expected)
        assert found["observation"].dtype == np.float32
        np.testing.assert_array_equal(found["action"], given["action"])
        np.testing.assert_array_equal(found["reward"], given["next.reward"][:, 0])
        np.testing.assert_array_equal(found["terminated"], given["next.terminated"][:, 0])
        np.testing.assert_array_equal(found["success"], given["next.success"][:, 0])
        assert found["episode_start"].tolist() == [True, *[False] * 3, True, *[False] * 5]


def test_a_mapping_names_features_of_other_sets(make: Callable[..., Any], tmp_path: Path) -> None:
    env = make(REACH)
    given = record(tmp_path / "set", env, {"more": Feature("float32", (4,))}, fps=30, robot="other")
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text("any_rate: true\nobservation: {goal: {feature: more, columns: [3, 0, 1]}}\n")
    found = training_arrays(tmp_path / "set", env, mapping)
    goal = env.unwrapped.observations.columns["goal"][1]
    np.testing.assert_array_equal(found["observation"][:, goal], given["more"][:, [3, 0, 1]])
    with pytest.raises(DataError, match="30 frames per second, the environment 25"):
        training_arrays(tmp_path / "set", env)
    record(tmp_path / "rate", env, {}, robot="other")
    with pytest.raises(DataError, match="another robot than 'irb120'"):
        training_arrays(tmp_path / "rate", env)


@pytest.mark.parametrize(
    ("mapping", "error", "message"),
    [
        ({"observation": {"goal": {"feature": "action", "columns": [0, 1]}}}, DataError, "takes 2 of the 6"),
        ({"observation": {"goal": {"feature": "action", "columns": [0, 1, 9]}}}, DataError, "of the 6 columns"),
        ({"observation": {"goal": {"feature": "action", "columns": "all"}}}, ConfigurationError, "list of whole"),
        ({"observation": {"goal": 3}}, ConfigurationError, "a feature's name"),
        ({"observation": {"goals": "action"}}, ConfigurationError, "Did you mean 'goal'"),
        ({"observation": [1]}, ConfigurationError, "a mapping from"),
        ({"actions": "action"}, ConfigurationError, "Did you mean 'action'"),
        ({"action": "missing"}, DataError, "no column 'missing'"),
        ({"action": "next.reward"}, DataError, "action has 6 elements, but the mapping takes 1"),
    ],
)
def test_a_wrong_mapping_raises(
    make: Callable[..., Any], tmp_path: Path, mapping: dict[str, Any], error: type[Exception], message: str
) -> None:
    env = make(REACH)
    record(tmp_path / "set", env, {})
    with pytest.raises(error, match=message):
        training_arrays(tmp_path / "set", env, mapping)


def test_missing_terms_are_listed_with_a_mapping_that_helps(make: Callable[..., Any], tmp_path: Path) -> None:
    env = make(REACH)
    with DatasetWriter(tmp_path / "set", 25, {"action": Feature("float32", (6,))}) as writer:
        writer.add({"action": np.zeros((3, 6))}, "")
    with pytest.raises(DataError, match=r"joint_positions, tcp_position, goal.*\{joint_positions: \{feature:"):
        training_arrays(tmp_path / "set", env)


@pytest.mark.parametrize(
    ("wrapper", "settings", "message"),
    [
        ("gymnasium.wrappers:TimeLimit", {"max_episode_steps": 9}, "without wrappers for single environments"),
        ("gymnasium.wrappers.vector:RescaleAction", {"min_action": -2.0, "max_action": 2.0}, "omit the wrapper"),
    ],
)
@pytest.mark.filterwarnings("ignore:.*precision lowered")
def test_a_set_does_not_contain_what_wrappers_change(
    make: Callable[..., Any], tmp_path: Path, wrapper: str, settings: dict[str, Any], message: str
) -> None:
    record(tmp_path / "set", make(REACH), {})
    env = make_vector_env(REACH, 2, {}, [ComponentConfig(name=wrapper, **settings)])
    with closing(env), pytest.raises(DataError, match=message):
        training_arrays(tmp_path / "set", env)


@pytest.mark.parametrize(
    ("scale", "names", "message"),
    [(57.3, (), "action in frame 0 is outside"), (1.0, tuple("xyzabc"), "its actions are x, y, z, a, b, c, those of")],
)
def test_actions_in_other_units_or_of_another_controller_raise(
    make: Callable[..., Any], tmp_path: Path, scale: float, names: tuple[str, ...], message: str
) -> None:
    env = make(REACH)
    record(tmp_path / "set", env, {"action": Feature("float32", (6,), names)}, scale=scale)
    with pytest.raises(DataError, match=message):
        training_arrays(tmp_path / "set", env)


def test_an_empty_set_raises(make: Callable[..., Any], tmp_path: Path) -> None:
    DatasetWriter(tmp_path / "set", 25, {"action": Feature("float32", (6,))}).close()
    with pytest.raises(DataError, match="no episodes"):
        training_arrays(tmp_path / "set", make(REACH))


def test_pictures_become_part_of_a_dictionary_if_they_fit(
    make: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    eye = {"eye": {"type": "camera", "camera": "eye", "size": [32, 48]}}
    cameras = {"eye": {"pos": [1.0, 0.0, 1.0], "target": [0.0, 0.0, 0.3]}}
    env = make(REACH, observations=eye, cameras=cameras)
    record(tmp_path / "set", make(REACH), {"observation.images.eye": Feature("video", (32, 48, 3))})
    found = training_arrays(tmp_path / "set", env)
    assert found["observation"]["eye"].shape == (10, 32, 48, 3)
    assert found["observation"]["eye"].std() > 10
    assert found["observation"]["observation"].shape == (10, 18)
    size = 32 * 48 * 3 + 18 * 4
    monkeypatch.setattr(memory, "available_memory", lambda: 10 * size - 1)
    with pytest.raises(ConfigurationError, match="use a data set of at most 9 steps"):
        training_arrays(tmp_path / "set", env)
