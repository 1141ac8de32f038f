"""The graph of a policy against the policy, on what environments really give and at the edges of what they may."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import onnx
import onnxruntime
import pytest
import stable_baselines3 as sb3
import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from frobs_algos.onnx import export_graph
from frobs_algos_sb3.features import SpatialSoftmax
from frobs_algos_sb3.onnx import policy_graph
from frobs_algos_sb3.ppo import PPO
from frobs_algos_sb3.vec_env import VectorEnvAdapter
from frobs_core import plugins
from frobs_core.util.errors import ConfigurationError
from frobs_train.environments import make_vector_env
from frobs_train.export.export import TOLERANCE, difference

contrib = pytest.importorskip("sb3_contrib")

Array = np.ndarray[Any, Any]
SLOW = pytest.mark.slow  # the tracer takes two seconds for each graph
REACH = "frobs/Irb120Reach-v0"
BOX = spaces.Box(-3.0, 3.0, (5,), np.float32)
ACTION = spaces.Box(np.float32([-2.0, -1.0]), np.float32([1.0, 3.0]))
IMAGE = spaces.Box(0, 255, (40, 36, 3), np.uint8)


class AnyEnv(gym.Env[Any, Any]):
    """Spaces, and random observations."""

    def __init__(self, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> None:
        self.observation_space, self.action_space = observation_space, action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return self.observation_space.sample(), 0.0, False, False, {}


class Real:
    """Environments of robots, and 1,000 observations of their episodes."""

    def __init__(self) -> None:
        self.venvs: dict[str, VectorEnvAdapter] = {}
        self.observations: dict[str, Array] = {}
        self.starts: dict[str, Array] = {}
        for controller in ("joint_delta_position", "discrete"):
            env = make_vector_env(REACH, 8, {"controller": controller})
            self.venvs[controller] = VectorEnvAdapter(env)
            env.action_space.seed(0)
            observation, _ = env.reset(seed=0)
            observations, starts = [observation], [np.ones(8, np.bool_)]
            for _ in range(124):  # episodes end at 50
                observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
                observations.append(observation)
                starts.append(terminated | truncated)
            self.observations[controller], self.starts[controller] = np.array(observations), np.array(starts)


@pytest.fixture(scope="module")
def real() -> Iterator[Real]:
    made = Real()
    yield made
    for venv in made.venvs.values():
        venv.close()


def edges(space: spaces.Box) -> Array:
    """Return 1,000 observations, each number of which is a bound, beside it, or 0."""
    rng = np.random.default_rng(0)
    choices = np.stack([space.low, space.high, np.nextafter(space.low, 0), np.nextafter(space.high, 0), 0 * space.low])
    picked = rng.integers(len(choices), size=(1000, *space.shape))
    return np.take_along_axis(choices, picked, axis=0).astype(np.float32)


def shaken(model: BaseAlgorithm) -> BaseAlgorithm:
    """Give a model weights that lead somewhere: fresh ones act near 0."""
    th.manual_seed(1)
    for parameter in model.policy.parameters():
        if parameter.ndim > 1:
            parameter.data += 0.3 / parameter.shape[1] ** 0.5 * th.randn_like(parameter)
    for name, buffer in model.policy.named_buffers():
        if name.endswith(("ra_mean", "ra_var")):  # of CrossQ's layers: as if it had seen something
            buffer += 0.5 * th.rand_like(buffer)
    return model


def session(graph: bytes) -> onnxruntime.InferenceSession:
    return onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])


def run(graph: bytes, feed: dict[str, Array]) -> dict[str, Array]:
    made = session(graph)
    return dict(zip([output.name for output in made.get_outputs()], made.run(None, feed), strict=True))


CASES = {
    "ppo": (sb3.PPO, {}),
    "ppo with sde": (sb3.PPO, {"use_sde": True, "policy_kwargs": {"squash_output": True, "net_arch": [32]}}),
    "a2c": (sb3.A2C, {"policy_kwargs": {"share_features_extractor": False}}),
    "sac": (sb3.SAC, {}),
    "sac with sde": (sb3.SAC, {"use_sde": True}),
    "td3": (sb3.TD3, {}),
    "ddpg": (sb3.DDPG, {}),
    "tqc": (contrib.TQC, {}),
    "crossq": (contrib.CrossQ, {}),
}


@pytest.mark.parametrize("name", [n if n in ("ppo", "sac") else pytest.param(n, marks=SLOW) for n in CASES])
def test_continuous_actions_are_the_trainers(name: str, real: Real) -> None:
    cls, kwargs = CASES[name]
    model = shaken(cls("MlpPolicy", real.venvs["joint_delta_position"], device="cpu", seed=0, **kwargs))
    space = model.observation_space
    assert isinstance(space, spaces.Box)
    graph = export_graph(lambda: policy_graph(model, None, space))
    for observation in (real.observations["joint_delta_position"].reshape(1000, -1), edges(space)):
        expected, _ = model.predict(observation, deterministic=True)
        found = run(graph, {"observation": observation})["action"]
        assert found.dtype == np.float32
        assert expected.std() > 0.05
        assert difference(model.action_space, expected, found, None) <= TOLERANCE


@pytest.mark.slow
def test_the_values_of_dqn_choose_as_the_trainer_unless_they_tie(real: Real) -> None:
    model = shaken(sb3.DQN("MlpPolicy", real.venvs["discrete"], device="cpu", seed=0, buffer_size=10))
    space = model.observation_space
    assert isinstance(space, spaces.Box)
    graph = export_graph(lambda: policy_graph(model, None, space))
    for observation in (real.observations["discrete"].reshape(1000, -1), edges(space)):
        expected, _ = model.predict(observation, deterministic=True)
        found = run(graph, {"observation": observation})
        assert len(set(expected.tolist())) > 2
        assert difference(model.action_space, expected, found["action"], found["scores"]) == 0.0
        with th.no_grad():
            values = model.q_net(th.as_tensor(observation)).numpy()
        np.testing.assert_allclose(found["scores"], values, rtol=1e-4, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("layers", [2, pytest.param(1, marks=SLOW)])
def test_a_recurrent_policy_carries_its_state_as_the_trainer_does(layers: int, real: Real) -> None:
    kwargs = {"n_lstm_layers": layers, "lstm_hidden_size": 32, "net_arch": [16]}
    venv = real.venvs["joint_delta_position"]
    model = shaken(contrib.RecurrentPPO("MlpLstmPolicy", venv, device="cpu", seed=0, policy_kwargs=kwargs))
    runner = session(export_graph(lambda: policy_graph(model, None, model.observation_space)))
    state, carried = None, [np.zeros((8, layers, 32), np.float32)] * 2
    rng = np.random.default_rng(0)
    observations, starts = real.observations["joint_delta_position"], real.starts["joint_delta_position"]
    starts = starts | (rng.random(starts.shape) < 0.02)  # at moments of their own too
    assert starts[1:100].any(axis=0).all()
    for observation, start in zip(observations[:100], starts[:100], strict=True):
        expected, state = model.predict(observation, state, start, deterministic=True)
        feed = {"observation": observation, "episode_start": start, "state/0": carried[0], "state/1": carried[1]}
        action, *carried = runner.run(["action", "next_state/0", "next_state/1"], feed)
        assert difference(model.action_space, expected, action, None) <= TOLERANCE


@pytest.mark.parametrize("clip", [10.0, pytest.param(0.5, marks=SLOW)])
def test_normalisation_is_in_the_graph(clip: float, real: Real) -> None:
    venv = VecNormalize(real.venvs["joint_delta_position"], clip_obs=clip)
    model = shaken(sb3.PPO("MlpPolicy", venv, device="cpu", seed=0))
    observation = real.observations["joint_delta_position"].reshape(1000, -1)
    venv.obs_rms.update(observation * 0.3 + 1000.0)  # a mean that is large beside its deviation
    space = model.observation_space
    assert isinstance(space, spaces.Box)
    graph = export_graph(lambda: policy_graph(model, venv, space))
    for given in (observation * 0.5 + 1000.0, observation, edges(space)):
        given = given.astype(np.float32)
        expected, _ = model.predict(venv.normalize_obs(given), deterministic=True)
        assert difference(model.action_space, expected, run(graph, {"observation": given})["action"], None) <= TOLERANCE


MANY = spaces.Dict({"vector": BOX, "image": IMAGE, "choice": spaces.Discrete(3), "matrix": spaces.Box(-1, 1, (2, 2))})


@pytest.mark.parametrize(
    ("policy", "observation_space", "action_space"),
    [
        ("MultiInputPolicy", MANY, ACTION),
        pytest.param("SpatialSoftmax", MANY, ACTION, marks=SLOW),
        pytest.param("SpatialSoftmax", IMAGE, ACTION, marks=SLOW),
        pytest.param("CnnPolicy", IMAGE, spaces.Discrete(4), marks=SLOW),
        pytest.param("MlpPolicy", spaces.Discrete(4), spaces.MultiDiscrete([2, 3, 4]), marks=SLOW),
        pytest.param("MlpPolicy", spaces.MultiDiscrete([4, 2]), spaces.MultiBinary(3), marks=SLOW),
        pytest.param("MlpPolicy", spaces.MultiBinary(6), ACTION, marks=SLOW),
        pytest.param("MlpPolicy", spaces.Box(-1, 1, (2, 3), np.float64), spaces.Box(-1, 1, (2, 2)), marks=SLOW),
    ],
    ids=[
        "dictionary",
        "points of a dictionary",
        "points",
        "image",
        "discrete",
        "multidiscrete",
        "multibinary",
        "doubles and matrices",
    ],
)
def test_every_kind_of_space_is_taken(policy: str, observation_space: Any, action_space: Any) -> None:
    kwargs = None
    if policy == "SpatialSoftmax":
        policy = "MultiInputPolicy" if isinstance(observation_space, spaces.Dict) else "CnnPolicy"
        kwargs = {"features_extractor_class": SpatialSoftmax}
    model = shaken(sb3.PPO(policy, AnyEnv(observation_space, action_space), policy_kwargs=kwargs, device="cpu", seed=0))
    graph = export_graph(lambda: policy_graph(model, None, observation_space))
    observation_space.seed(0)
    samples = [observation_space.sample() for _ in range(100)]
    if isinstance(observation_space, spaces.Dict):
        batch: Any = {key: np.stack([sample[key] for sample in samples]) for key in observation_space}
        feed = {f"observation/{key}": value for key, value in batch.items()}
    else:
        batch = np.stack(samples)
        feed = {"observation": batch}
    expected, _ = model.predict(batch, deterministic=True)
    found = run(graph, feed)
    assert found["action"].shape == expected.shape
    assert difference(action_space, expected, found["action"], found.get("scores")) <= TOLERANCE
    single = run(graph, {key: value[:1] for key, value in feed.items()})["action"]
    np.testing.assert_allclose(single, found["action"][:1], atol=1e-5)


@pytest.mark.slow
def test_the_same_policy_is_the_same_bytes_without_a_word_and_without_a_trace_of_the_machine(
    capfd: pytest.CaptureFixture[str], make: Any
) -> None:
    algorithm = PPO(make(), {"policy_kwargs": {"net_arch": [8]}}, 0)
    before = {name: value.clone() for name, value in algorithm.model.policy.state_dict().items()}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        first = algorithm.export_onnx()
    assert algorithm.export_onnx() == first
    assert capfd.readouterr() == ("", "")
    proto = onnx.load_from_string(first)
    assert not proto.metadata_props
    assert all(not node.metadata_props and not node.doc_string for node in proto.graph.node)
    assert b"site-packages" not in first
    for name, value in algorithm.model.policy.state_dict().items():
        assert th.equal(before[name], value)


def test_the_scale_that_a_task_suggests_is_in_the_graph(make: Any) -> None:
    env = make()
    algorithm = PPO(env, {"policy_kwargs": {"net_arch": [8]}}, 0)
    shaken(algorithm.model)
    observation = edges(env.single_observation_space)
    found = run(algorithm.export_onnx(), {"observation": observation})["action"]
    expected, _ = algorithm.predict(observation)
    assert difference(env.single_action_space, expected, found, None) <= TOLERANCE


NAMES = ["a2c", "crossq", "ddpg", "dqn", "ppo", "recurrent_ppo", "sac", "td3", "tqc"]


def test_every_algorithm_of_this_distribution_is_tried() -> None:
    offered = plugins.records("algorithm").values()
    assert [record.name for record in offered if record.entry_point.startswith("frobs_algos_sb3.")] == NAMES


@SLOW
@pytest.mark.parametrize("name", NAMES)
def test_what_was_trained_saved_and_loaded_is_exported(name: str, make: Any, monitor: Any, tmp_path: Path) -> None:
    env = make(controller="discrete" if name == "dqn" else "joint_delta_position")
    small = {"n_steps": 8, "batch_size": 16} if "ppo" in name else {"n_steps": 8} if name == "a2c" else {}
    if not small:
        small = {"learning_starts": 16, "buffer_size": 200}
    config = {"normalize_observation": True, "policy_kwargs": {"net_arch": [16]}, **small}
    cls = plugins.get_record("algorithm", name).load()
    algorithm = cls(env, config, 0)
    algorithm.train(96, monitor)
    algorithm.save(tmp_path)
    loaded = cls.load(tmp_path)
    runner = session(loaded.export_onnx())
    states = [item for item in runner.get_inputs() if item.name.startswith("state/")]
    carried = {item.name: np.zeros((4, *item.shape[1:]), np.float32) for item in states}
    observation, _ = env.reset(seed=3)
    state, start = None, np.ones(4, np.bool_)
    for _ in range(60):  # past the episodes' end
        expected, state = loaded.predict(observation, state, start)
        feed = {"observation": observation, **carried, **({"episode_start": start} if carried else {})}
        outputs = dict(zip([item.name for item in runner.get_outputs()], runner.run(None, feed), strict=True))
        assert difference(env.single_action_space, expected, outputs["action"], outputs.get("scores")) <= TOLERANCE
        carried = {key: outputs[f"next_{key}"] for key in carried}
        observation, _, terminated, truncated, _ = env.step(expected)
        start = terminated | truncated


def test_a_policy_of_an_unknown_kind_is_refused() -> None:
    model = contrib.QRDQN("MlpPolicy", AnyEnv(BOX, spaces.Discrete(3)), device="cpu", buffer_size=10)
    with pytest.raises(ConfigurationError, match="QRDQNPolicy cannot be exported"):
        export_graph(lambda: policy_graph(model, None, BOX))


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch, make: Any) -> None:
    monkeypatch.setattr("frobs_algos.onnx.find_spec", lambda name: None)
    with pytest.raises(
        ConfigurationError, match=r"onnx and onnxscript; install with: pip install -e '.*frobs-algos\[export\]'"
    ):
        PPO(make(), {"policy_kwargs": {"net_arch": [8]}}, 0).export_onnx()
