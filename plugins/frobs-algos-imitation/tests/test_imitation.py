"""The imitation algorithms as ordinary algorithms: learning, memory, files, exact resume and export."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th

from frobs_algos.demonstrations import Demonstrations, collect
from frobs_algos_imitation.act import ACT
from frobs_algos_imitation.bc import BC
from frobs_algos_imitation.dagger import Dagger
from frobs_algos_imitation.samples import Samples
from frobs_core.util.errors import CheckpointError, ConfigurationError, FrobsError, IncompatibleSpaceError
from frobs_train import Progress, Run, evaluate, resolve_config, resume, train
from frobs_train.environments import EnvironmentRecipe, make_vector_env

LIFT = "frobs/PandaLift-v0"
SMALL = {
    "bc": ["algorithm_config.net_arch=[32]", "algorithm_config.demonstration_episodes=2", "algorithm_config.history=3"],
    "act": [
        *("algorithm_config.width=8", "algorithm_config.heads=2", "algorithm_config.chunk=4"),
        *("algorithm_config.demonstration_episodes=2", "algorithm_config.history=2"),
    ],
    "dagger": ["algorithm_config.net_arch=[32]", "algorithm_config.updates=5", "algorithm_config.final_updates=9"],
}
STEPS = {"bc": 30, "act": 20, "dagger": 3 * 2 * 75}


class Killed(BaseException):
    """Stands for a kill: nothing catches it, and nothing is written after it."""


class Spaces:
    """The spaces of an environment."""

    def __init__(self, observation: gym.Space[Any], action: gym.Space[Any] | None = None) -> None:
        self.num_envs = 1
        self.single_observation_space = observation
        self.single_action_space = action or gym.spaces.Box(np.float32([-1.0, -2.0]), np.float32([1.0, 6.0]))


VECTOR = Spaces(gym.spaces.Box(-np.inf, np.inf, (3,), np.float32))
GOAL = Spaces(
    gym.spaces.Dict({key: gym.spaces.Box(-9, 9, (2,), np.float32) for key in ("observation", "desired_goal")})
)


def small_config(algorithm: str, *settings: str) -> Any:
    flags = {"algorithm": algorithm, "steps": STEPS[algorithm], "num_envs": 2, "seed": 3}
    return resolve_config(LIFT, flags=flags, settings=[*SMALL[algorithm], "log_every=1", *settings])


def shown(space: Spaces, n: int = 40, episode: int = 10) -> Demonstrations:
    rng = np.random.default_rng(0)
    action = rng.uniform([-1.0, -2.0], [1.0, 6.0], (n, 2)).astype(np.float32)
    parts: Any = space.single_observation_space
    observation: Any = rng.normal(size=(n, 3)).astype(np.float32)
    if isinstance(parts, gym.spaces.Dict):
        observation = {key: rng.normal(size=(n, 2)).astype(np.float32) for key in reversed(parts.spaces)}
    start = np.arange(n) % episode == 0
    zeros = np.zeros(n, np.float32)
    return Demonstrations(
        observation=observation,
        action=action,
        reward=zeros,
        next_observation=observation,
        terminated=zeros > 0,
        episode_start=start,
        intervention=zeros == 0,
        complete=zeros > 0,
    )


def untrained(cls: Any, spaces: Any, config: dict[str, Any], seed: int) -> Any:
    """Return an algorithm without demonstrations."""
    algorithm = cls.__new__(cls)
    algorithm._build(spaces, cls.resolve_config(config), seed, None)
    return algorithm


def weights(run: Run) -> dict[str, th.Tensor]:
    folder = run.newest_checkpoint()[0].path / "algorithm"
    return th.load(folder / "policy.pt", weights_only=True)


@pytest.mark.parametrize("algorithm", ["bc", "dagger", pytest.param("act", marks=pytest.mark.slow)])
def test_an_interrupted_run_equals_an_uninterrupted_one(algorithm: str, tmp_path: Path) -> None:
    whole = train(small_config(algorithm), tmp_path / "whole")
    third = STEPS[algorithm] // 3

    def kill(progress: Progress) -> None:
        if progress.steps > third:
            raise Killed

    with pytest.raises(Killed):
        train(small_config(algorithm, f"checkpoint_every={third}"), tmp_path / "cut", kill)
    cut = Run.open(tmp_path / "cut")
    assert cut.newest_checkpoint()[0].steps == third
    again = resume(cut)
    for name, value in weights(whole).items():
        assert th.equal(value, weights(again)[name]), name


def test_dagger_labels_with_the_expert_and_acts_as_the_learner(tmp_path: Path) -> None:
    run = train(small_config("dagger"), tmp_path / "run")
    samples = Samples.read(run.newest_checkpoint()[0].path / "algorithm" / "samples")
    assert len(samples.parts) == 3
    assert len(samples) == STEPS["dagger"]
    assert int(samples.parts[0]["episode_start"].sum()) == 2
    assert np.abs(samples.labels.numpy()).max() <= 1.0


def test_a_round_of_episodes_without_end_is_cut_off(tmp_path: Path) -> None:
    run = train(small_config("dagger", "environment_kwargs.max_episode_steps=100000"), tmp_path / "run")
    samples = Samples.read(run.newest_checkpoint()[0].path / "algorithm" / "samples")
    assert len(samples.parts) == 1
    assert len(samples) == STEPS["dagger"]


def test_behavior_cloning_imitates(tmp_path: Path) -> None:
    algorithm = untrained(BC, VECTOR, {"net_arch": [64, 64], "learning_rate": 0.01}, seed=0)  # type: ignore[arg-type]
    data = shown(VECTOR)
    algorithm.samples = Samples.of(data.observation, None, data.action, data.episode_start)
    algorithm.policy.normalize(algorithm.samples.frames)
    for index in range(600):
        algorithm._update(index / 600)
    action, state = algorithm.predict(data.observation)
    assert state is None
    assert np.abs(action - data.action).mean() < 0.2  # the second action spans 8


def test_a_window_begins_with_the_episode() -> None:
    frames = np.arange(6, dtype=np.float32)[:, None]
    action = 10.0 + np.arange(6, dtype=np.float32)[:, None]
    samples = Samples.of(frames, action, action, np.array([1, 0, 0, 1, 0, 0], bool))
    windows, labels, valid = samples.batch(th.tensor([0, 2, 4]), history=3, chunk=3)
    assert windows[:, :, 0].tolist() == [[0, 0, 0], [0, 1, 2], [3, 3, 4]]
    assert windows[:, :, 1].tolist() == [[0, 0, 0], [0, 10, 11], [0, 0, 13]]  # the previous action; 0 at the start
    assert labels[:, :, 0].tolist() == [[10, 11, 12], [12, 12, 12], [14, 15, 15]]
    assert valid.tolist() == [[True, True, True], [True, False, False], [True, True, False]]


@pytest.mark.parametrize(
    ("cls", "config"),
    [
        (BC, {"history": 3, "net_arch": [16]}),
        (ACT, {"history": 1, "chunk": 4, "width": 8, "heads": 2}),
        (ACT, {"history": 2, "chunk": 4, "width": 8, "heads": 2}),
    ],
)
def test_rows_of_a_batch_do_not_leak_into_each_other(cls: type[BC], config: dict[str, Any]) -> None:
    """Episodes of a batch end at different steps; every row acts as if it were alone."""
    algorithm = untrained(cls, VECTOR, config, seed=0)  # type: ignore[arg-type]
    rng = np.random.default_rng(1)
    seen = rng.normal(size=(20, 3, 3)).astype(np.float32)  # (steps, rows, size)
    starts = np.zeros((20, 3), bool)
    starts[0], starts[5, 0], starts[6, 1], starts[13, 0] = True, True, True, True
    state, together = None, []
    for observation, start in zip(seen, starts, strict=True):
        action, state = algorithm.predict(observation, state, start)
        together.append(action)
    for row in range(3):
        state = None
        for step in range(20):
            if starts[step, row]:
                state = None
            action, state = algorithm.predict(seen[step, [row]], state, starts[step, [row]])
            np.testing.assert_allclose(action[0], together[step][row], atol=1e-5)


def test_the_memory_in_acting_equals_the_windows_of_learning() -> None:
    algorithm = untrained(BC, VECTOR, {"history": 3, "net_arch": [16]}, seed=0)  # type: ignore[arg-type]
    rng = np.random.default_rng(2)
    seen, starts, state, acted = rng.normal(size=(12, 3)).astype(np.float32), np.arange(12) % 5 == 0, None, []
    for observation, start in zip(seen, starts, strict=True):
        action, state = algorithm.predict(observation[None], state, np.array([start]))
        acted.append(action[0])
    samples = Samples.of(seen, np.stack(acted), np.stack(acted), starts)
    windows, _, _ = samples.batch(th.arange(12), 3, 1)
    with th.no_grad():
        expected = algorithm.policy.low + 0.5 * (algorithm.policy.predictions(windows)[:, 0] + 1.0) * (
            algorithm.policy.high - algorithm.policy.low
        )
    np.testing.assert_allclose(np.clip(expected.numpy(), [-1.0, -2.0], [1.0, 6.0]), np.stack(acted), atol=1e-5)


def test_predictions_of_the_same_action_are_averaged() -> None:
    """The weights are those of Zhao et al. 2023: exp(−m·i), where the oldest prediction has i = 0."""
    algorithm = untrained(ACT, VECTOR, {"chunk": 3, "width": 8, "heads": 2, "ensemble": 0.5}, seed=0)  # type: ignore[arg-type]
    seen = np.random.default_rng(3).normal(size=(6, 3)).astype(np.float32)
    with th.no_grad():
        chunks = algorithm.policy.predictions(th.as_tensor(seen)[:, None]).numpy()  # (steps, chunk, size)
    state = None
    for step in range(6):
        action, state = algorithm.predict(seen[[step]], state, np.array([step == 0]))
        old = range(max(0, step - 2), step + 1)
        weight = np.exp(-0.5 * np.arange(len(old)))[:, None]
        mean = (weight * [chunks[of][step - of] for of in old]).sum(0) / weight.sum()
        expected = np.array([-1.0, -2.0]) + 0.5 * (mean + 1.0) * np.array([2.0, 8.0])
        np.testing.assert_allclose(action[0], np.clip(expected, [-1.0, -2.0], [1.0, 6.0]), atol=1e-5)


def test_goal_conditioned_observations_are_read_in_the_order_of_the_space(tmp_path: Path) -> None:
    algorithm = untrained(BC, GOAL, {"net_arch": [8]}, seed=0)  # type: ignore[arg-type]
    data: Any = shown(GOAL).observation
    mixed = {key: data[key] for key in ("observation", "desired_goal")}
    swapped = {key: data[key] for key in ("desired_goal", "observation")}
    np.testing.assert_array_equal(algorithm.predict(mixed)[0], algorithm.predict(swapped)[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cls", "config", "spaces"),
    [
        (BC, {"history": 4, "net_arch": [16]}, VECTOR),
        (BC, {"history": 1, "net_arch": [16]}, GOAL),
        (ACT, {"history": 2, "chunk": 4, "width": 8, "heads": 2}, GOAL),
        (Dagger, {"history": 1, "net_arch": [16]}, VECTOR),
    ],
)
def test_the_graph_acts_as_the_policy(cls: Any, config: dict[str, Any], spaces: Spaces) -> None:
    import onnxruntime

    algorithm = untrained(cls, spaces, config, seed=0)
    session = onnxruntime.InferenceSession(algorithm.export_onnx(), providers=["CPUExecutionProvider"])
    rng, state = np.random.default_rng(4), None
    shapes = algorithm.policy.state_shapes
    carried = [np.zeros((5, *shape), np.float32) for shape in shapes]
    for step in range(8):
        start = np.full(5, step == 0) | (rng.random(5) < 0.2)
        parts = {
            key: rng.normal(size=(5, *part.shape)).astype(np.float32) for key, part in algorithm.policy.spaces.items()
        }
        observation = parts.get("", parts)
        action, state = algorithm.predict(observation, state, start)
        inputs = {f"observation/{key}" if key else "observation": part for key, part in parts.items()}
        inputs |= {f"state/{i}": part for i, part in enumerate(carried)} | ({"episode_start": start} if shapes else {})
        found, *carried = session.run(None, inputs)
        np.testing.assert_allclose(found, action, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["bc", "act"])
def test_a_policy_with_memory_acts_alike_in_evaluation_and_from_a_bundle(algorithm: str, tmp_path: Path) -> None:
    from frobs_core import load_policy
    from frobs_deploy import Policy as DeployedPolicy
    from frobs_train.export.export import export

    run = train(small_config(algorithm), tmp_path / "run")
    export(run, tmp_path / "policy.frobs")
    env = make_vector_env(LIFT, 3, {"max_episode_steps": 9, "stagger": True})
    trained, bundled = load_policy(run.path, env), load_policy(tmp_path / "policy.frobs", env)
    deployed, start = (
        DeployedPolicy(tmp_path / "policy.frobs"),
        np.ones(3, bool),
    )
    observation, _ = env.reset(seed=0)
    for _ in range(30):
        action = trained.act(observation, start)
        np.testing.assert_allclose(bundled.act(observation, start), action, atol=1e-4)
        deployed.reset(start)
        np.testing.assert_allclose(deployed.act(observation), action, atol=1e-4)
        observation, _, terminated, truncated, _ = env.step(action)
        start = terminated | truncated
    env.close()


def test_demonstrations_are_whole_episodes() -> None:
    class Owner:
        recipe = EnvironmentRecipe(LIFT, {"max_episode_steps": 7})

    data = collect(Owner(), "expert", 5, seed=0)  # type: ignore[arg-type]
    assert np.flatnonzero(data.episode_start).tolist() == [0, 7, 14, 21, 28]
    assert data.action.dtype == np.float32
    assert len({row.tobytes() for row in np.asarray(data.observation)[data.episode_start]}) == 5


def test_a_run_is_evaluated_like_any_other(tmp_path: Path) -> None:
    run = train(small_config("dagger", "algorithm_config.history=2"), tmp_path / "run")
    assert evaluate(run, 4).episodes == 4


@pytest.mark.parametrize(
    ("algorithm", "settings", "message"),
    [
        ("bc", ["algorithm_config.demonstrations=nobody"], "nobody"),
        ("bc", ["algorithm_config.demonstrations=./missing"], "missing"),
        ("dagger", ["algorithm_config.updats=3"], "updates"),
        ("dagger", ["algorithm_config.expert=nobody"], "nobody"),
        ("act", ["algorithm_config.heads=3"], "heads"),
        ("bc", ["algorithm_config.net_arch=[]"], "net_arch"),
    ],
)
def test_bad_settings_are_named(algorithm: str, settings: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(FrobsError, match=message):
        train(small_config(algorithm, *settings), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_spaces_that_cannot_be_learned_are_named() -> None:
    with pytest.raises(IncompatibleSpaceError, match="vectors and color pictures"):
        BC(Spaces(gym.spaces.Discrete(3)), {}, seed=0)  # type: ignore[arg-type]
    with pytest.raises(ConfigurationError, match="bounds"):
        BC(Spaces(VECTOR.single_observation_space, gym.spaces.Discrete(3)), {}, seed=0)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["policy.pt", "training.pt", "samples/part_00000.npz", "algorithm.json"])
def test_damaged_files_are_named(name: str, tmp_path: Path) -> None:
    algorithm = untrained(BC, VECTOR, {"net_arch": [8]}, seed=0)  # type: ignore[arg-type]
    data = shown(VECTOR)
    algorithm.samples = Samples.of(data.observation, None, data.action, data.episode_start)
    (tmp_path / "good").mkdir()
    algorithm.save(tmp_path / "good")
    shutil.copytree(tmp_path / "good", tmp_path / "bad")
    (tmp_path / "bad" / name).write_bytes(b"nothing")
    with pytest.raises((CheckpointError, ConfigurationError)):
        BC.load(tmp_path / "bad", VECTOR)  # type: ignore[arg-type]
