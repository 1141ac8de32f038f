from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

from frobs_cli.program import program
from frobs_core.contracts import Algorithm
from frobs_core.models import load_model
from frobs_core.util.errors import CheckpointError, ConfigurationError, RunError
from frobs_deploy import Policy, read_bundle
from frobs_deploy.errors import BundleError, BundleMismatchError
from frobs_models import fingerprint
from frobs_train import Run, evaluate, resolve_config, train
from frobs_train.environments import make_env, make_vector_env
from frobs_train.export.bundle_run import open_run_or_bundle
from frobs_train.export.export import Export, difference, export
from frobs_train.export.export_facts import environment_facts
from frobs_train.runs.policy import load_algorithm

REACH = "frobs/Irb120Reach-v0"


@pytest.fixture(scope="module")
def reach(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run on an arm with joint positions; do not change it."""
    config = resolve_config(
        REACH,
        flags={"num_envs": 4, "steps": 256, "seed": 1, "controller": "joint_position"},
        settings=["algorithm_config.n_steps=16", "algorithm_config.batch_size=64"],
    )
    return train(config, tmp_path_factory.mktemp("runs") / "reach")


@pytest.fixture(scope="module")
def exported(reach: Run) -> Export:
    """Its bundle."""
    return export(reach, license="MIT")


def test_the_bundle_says_what_the_policy_is_for(reach: Run, exported: Export) -> None:
    assert exported.path == reach.path / "policy.frobs"
    assert exported.observations == 256
    assert exported.max_difference <= 1e-5
    said: Any = read_bundle(exported.path).manifest
    assert said["environment"]["id"] == REACH
    assert {said["environment"][key] for key in ("task", "simulator")} == {"reach", "mujoco"}
    assert said["control_timestep"] == 0.04
    assert said["controller"] == {"name": "joint_position", "command": "position", "parameters": {}, "laws": [{}]}
    robot = said["robot"]
    assert robot["fingerprint"] == fingerprint(load_model("frobs_robots_abb:models/irb120.urdf.xacro"))
    assert (robot["name"], robot["tcp"], robot["base"]) == ("irb120", "tool0", "fixed")
    assert [joint["name"] for joint in robot["joints"]] == [f"joint_{i}" for i in range(1, 7)]
    assert robot["joints"][0]["units"] == {"position": "rad", "velocity": "rad/s", "effort": "N·m"}
    assert {"position_lower", "position_upper", "velocity", "effort", "home"} <= set(robot["joints"][0])
    terms = said["observation"]["terms"]
    assert terms[0] == {"name": "joint_positions", "columns": [0, 5], "unit": "rad or m"}
    assert terms[-1]["columns"][1] + 1 == said["observation"]["spaces"][""]["shape"][0]
    assert said["action"]["space"]["low"] == -1.0
    training = said["training"]
    assert (training["algorithm"], training["steps"], training["seed"]) == ("ppo", 256, 1)
    assert training["config"]["environment_kwargs"] == {"controller": "joint_position"}
    assert training["command"].startswith(f"frobs train {REACH} --controller joint_position --num-envs 4 --steps 256")
    assert training["seconds"] == training["curve"]["seconds"][-1] > 0.0
    assert training["curve"]["steps"][-1] == 256
    assert said["environment"]["parameters"] == {"goal_low": [-0.5, -0.5, 0.0], "goal_high": [0.5, 0.5, 1.0]}
    assert len(training["config_sha256"]) == 64
    assert training["versions"]["libraries"]["torch"]
    assert said["license"] == "MIT"
    assert said["check"]["observations"] == 256
    assert said["check"]["max_difference"] <= said["check"]["tolerance"] == 1e-5


def keys(value: Any) -> set[str]:
    if isinstance(value, dict):
        return {key for key in value if key} | {key for item in value.values() for key in keys(item)}
    return {key for item in value for key in keys(item)} if isinstance(value, list) else set()


def test_the_reference_explains_every_key_of_the_bundle(exported: Export) -> None:
    said: Any = read_bundle(exported.path).manifest
    for where in ("config", "versions", "evaluations"):  # explained on the page of the run folder
        said["training"].pop(where)
    said["export"].pop("versions")
    said["environment"].pop("parameters")  # explained on the page of the ID
    page = (Path(__file__).parents[3] / "docs" / "reference" / "bundle.md").read_text("utf-8")
    explained = set(re.findall(r"`([\w.]+)`", page))
    assert sorted(keys(said) - explained) == []


def test_the_bundle_acts_as_the_trainers_policy_in_the_environment(reach: Run, exported: Export) -> None:
    env = make_env(REACH, reach.config.environment_kwargs)
    base: Any = env.unwrapped
    policy = Policy(
        exported.path,
        robot=fingerprint(base.robot.model),
        joint_names=base.robot.joint_names,
        control_timestep=base.control_timestep,
    )
    trained, _ = load_algorithm(reach, env.observation_space, env.action_space)
    observation, _ = env.reset(seed=5)
    for _ in range(20):
        action = policy.act(observation)
        expected, _ = trained.predict(observation[None])
        np.testing.assert_allclose(action, expected[0], atol=1e-5)
        assert env.action_space.contains(action)
        observation, *_ = env.step(action)
    env.close()


def test_the_joints_velocity_limits_what_an_action_changes(exported: Export) -> None:
    policy = Policy(exported.path, max_change="joint_velocity")
    joints: Any = policy.bundle.manifest["robot"]["joints"]
    expected = [0.04 * 2 * joint["velocity"] / (joint["position_upper"] - joint["position_lower"]) for joint in joints]
    assert policy.manifest.max_action_change is not None
    np.testing.assert_allclose(policy.manifest.max_action_change, expected)


def test_another_robot_and_another_rate_are_refused(exported: Export) -> None:
    with pytest.raises(BundleMismatchError, match="the policy was trained with"):
        Policy(exported.path, control_timestep=0.02)
    with pytest.raises(BundleMismatchError, match="differs from the robot used in training"):
        Policy(exported.path, robot="00" * 32)


def test_the_same_run_gives_the_same_bytes(reach: Run, exported: Export, tmp_path: Path) -> None:
    assert export(reach, tmp_path / "again.frobs", license="MIT").path.read_bytes() == exported.path.read_bytes()


def test_evaluations_of_the_checkpoint_go_with_it(copied: Run, quick: None) -> None:
    folder = copied.path / "evaluations"
    folder.mkdir()
    for steps in (1600, 2000):
        (folder / f"{steps}.json").write_text(
            json.dumps({"steps": steps, "episodes": 9, "seed": 0, "mean_reward": 0.5})
        )
    said: Any = read_bundle(export(copied).path).manifest
    assert said["training"]["evaluations"] == [{"steps": 2000, "episodes": 9, "seed": 0, "mean_reward": 0.5}]


class Frozen(Algorithm):
    """Answers as its graph does, the action being half of the observation, but for an error."""

    wrong = 0.0

    def __init__(self, env: Any, config: Any, seed: int) -> None: ...

    @classmethod
    def resolve_config(cls, config: Any) -> dict[str, Any]:
        return {}

    def train(self, steps: int, monitor: Any) -> None: ...

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> Any:
        return np.clip(0.5 * observation + self.wrong, -1.0, 1.0).astype(np.float32), None

    def save(self, folder: Path, previous: Path | None = None) -> None: ...

    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Frozen:
        made = cls(None, {}, 0)
        made.observation_space = gym.spaces.Box(-4.0, 4.0, (1,), np.float32)
        made.action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        return made

    def export_onnx(self) -> bytes:
        from onnx import TensorProto, checker, helper, numpy_helper

        batch = {
            name: helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", 1]) for name in ("observation", "action")
        }
        node = helper.make_node("Mul", ["observation", "half"], ["action"])
        half = numpy_helper.from_array(np.array([0.5], np.float32), "half")
        graph = helper.make_graph([node], "half", [batch["observation"]], [batch["action"]], [half])
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=8)
        checker.check_model(model)
        return bytes(model.SerializeToString())


class Mute(Frozen):
    """Cannot be exported."""

    export_onnx = Algorithm.export_onnx


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Put a small algorithm of another framework in the place of the run's, so that no network has to be traced."""

    class Record:
        algorithm: type[Algorithm] = Frozen

        def load(self) -> type[Algorithm]:
            return self.algorithm

    record = Record()

    def choose(algorithm: type[Algorithm]) -> None:
        record.algorithm = algorithm

    monkeypatch.setattr("frobs_train.runs.policy.algorithm_record", lambda name: record)
    yield choose
    Frozen.wrong = 0.0


def test_any_algorithm_can_be_exported_that_has_a_graph(copied: Run, quick: Any, tmp_path: Path) -> None:
    found = export(copied, tmp_path / "other" / "line.frobs")
    said: Any = read_bundle(found.path).manifest
    assert (said["robot"], said["controller"], said["control_timestep"]) == (None, None, None)
    assert said["observation"]["terms"] == []
    assert Policy(found.path).act(np.array([1.0], np.float32)) == 0.5


def test_a_run_on_a_paced_simulator_is_exported_with_one_environment(
    copied: Run, quick: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []

    def make(id: str, num_envs: int, *rest: Any) -> Any:
        made.append(num_envs)
        return make_vector_env(id, num_envs, *rest)

    monkeypatch.setattr("frobs_train.evaluation.evaluate.is_paced", lambda simulator: True)
    monkeypatch.setattr("frobs_train.evaluation.evaluate.make_vector_env", make)
    assert export(copied).observations == 256
    assert made == [1]


def test_an_algorithm_without_a_graph_is_refused_by_name(copied: Run, quick: Any) -> None:
    quick(Mute)
    with pytest.raises(ConfigurationError, match="the algorithm Mute cannot be exported"):
        export(copied)
    assert not list(copied.path.glob("*.frobs"))


@pytest.mark.parametrize("wrong", [2e-5, 1.0, np.nan])
def test_a_graph_that_does_not_act_as_the_trainer_is_not_written(
    wrong: float, copied: Run, quick: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Frozen, "wrong", wrong)
    (copied.path / "policy.frobs").write_bytes(b"the one before")
    with pytest.raises(BundleError, match=r"was not written: its actions, scaled to \[-1, 1\], differ"):
        export(copied)
    assert (copied.path / "policy.frobs").read_bytes() == b"the one before"


def test_a_checkpoint_is_chosen_by_its_steps(copied: Run, quick: Any) -> None:
    assert export(copied).steps == 2000
    assert export(copied, checkpoint="1600").steps == 1600
    with pytest.raises(CheckpointError, match=r"has no checkpoint '7'"):
        export(copied, checkpoint="7")
    next((copied.path / "checkpoints" / "step_000001600").rglob("*.pt")).write_bytes(b"x")
    with pytest.raises(CheckpointError, match="is damaged"):
        export(copied, checkpoint="1600")


def test_a_bundle_is_evaluated_as_a_run_is(copied: Run, quick: Any) -> None:
    bundle = open_run_or_bundle(export(copied).path)
    data = bundle.path.read_bytes()
    expected, found = evaluate(copied, 8), evaluate(bundle, 8)
    assert (found.mean_reward, found.success_rate, found.steps) == (expected.mean_reward, expected.success_rate, 2000)
    assert bundle.path.read_bytes() == data
    with pytest.raises(RunError, match="omit --checkpoint"):
        evaluate(bundle, 8, checkpoint="best")
    with pytest.raises(RunError, match="cannot be sampled"):
        evaluate(bundle, 8, deterministic=False)
    other = open_run_or_bundle(bundle.path)
    other.config = copied.config.model_copy(update={"environment": "CartPole-v1"})
    with pytest.raises(BundleMismatchError, match="observation space differs"):
        evaluate(other, 8)


def test_what_is_neither_a_run_nor_a_bundle_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="is not a folder"):
        open_run_or_bundle(tmp_path / "missing")
    (tmp_path / "text").write_text("hello")
    with pytest.raises(BundleError, match="not a policy bundle"):
        open_run_or_bundle(tmp_path / "text")


@pytest.mark.filterwarnings("ignore:.*precision lowered")  # Gymnasium's, of its own bounds
def test_a_wrapped_environment_is_told_as_the_policy_sees_it(quick: Any) -> None:
    wrapper = {"name": "gymnasium.wrappers:RescaleAction", "min_action": -0.5, "max_action": 0.5}
    config = resolve_config(REACH, flags={"wrappers": [wrapper], "controller": "joint_position"})
    env = make_vector_env(REACH, 2, config.environment_kwargs, config.wrappers)
    said = environment_facts(env, config)
    env.close()
    assert said["environment"]["wrappers"] == [wrapper]
    assert said["robot"]["name"] == "irb120"
    assert said["action"] == {"space": {**said["action"]["space"], "low": -0.5, "high": 0.5}, "max_change": None}
    assert said["observation"]["terms"]


def test_the_license_is_a_name_or_a_text(copied: Run, quick: Any, tmp_path: Path) -> None:
    assert "No license was given" in read_bundle(export(copied).path).license
    assert read_bundle(export(copied).path).manifest["license"] is None
    named = read_bundle(export(copied, license="Apache-2.0 WITH LLVM-exception").path)
    assert named.license == "SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception\n"
    text = tmp_path / "LICENSE"
    text.write_text("Our Own License\n\nYou may.\n")
    given = read_bundle(export(copied, license=str(text)).path)
    assert (given.manifest["license"], given.license) == ("Our Own License", text.read_text())
    text.write_text(" \n")
    for wrong, message in [
        ("missing/file.txt", "neither an existing file nor an SPDX identifier"),
        (str(text), "is empty"),
    ]:
        with pytest.raises(ConfigurationError, match=message):
            export(copied, license=wrong)


def test_the_commit_that_the_run_lies_in_is_written_down(copied: Run, quick: Any) -> None:
    def git(*arguments: str) -> str:
        command = ["git", "-C", str(copied.path), "-c", "user.name=n", "-c", "user.email=e", *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    said: Any = read_bundle(export(copied).path).manifest
    assert said["export"]["commit"] is None
    git("init")
    git("add", "config.yaml")
    git("commit", "-m", "run")
    said = read_bundle(export(copied).path).manifest
    assert said["export"]["commit"] == {"commit": git("rev-parse", "HEAD"), "clean": True}


@pytest.mark.parametrize(
    ("space", "expected", "found", "scores", "result"),
    [
        (gym.spaces.Box(np.zeros(2, np.float32), np.array([2, 4], np.float32)), [[1, 1]], [[1.1, 1.1]], None, 0.1),
        (gym.spaces.Box(-1, 1, (1,)), [[np.nan]], [[0.0]], None, np.inf),
        (gym.spaces.Discrete(3), [0, 1], [0, 1], [[3, 2, 1], [0, 9, 0]], 0.0),
        (gym.spaces.Discrete(3), [0, 1], [0, 2], [[3, 2, 1], [0, 9, 0]], 2.0),
        (gym.spaces.Discrete(3), [0], [1], [[1000.0, 1000.001, 0]], 0.0),
        (gym.spaces.Discrete(3), [0], [1], [[0.1, 0.1001, 0]], 2.0),
        (gym.spaces.MultiDiscrete([2, 2]), [[0, 1]], [[0, 0]], [[5, 4, 3, 3]], 0.0),
        (gym.spaces.MultiDiscrete([2, 2]), [[0, 1]], [[1, 1]], [[5, 4, 3, 3]], 2.0),
        (gym.spaces.MultiBinary(2), [[0, 1]], [[1, 1]], [[1e-9, 5.0]], 0.0),
        (gym.spaces.MultiBinary(2), [[0, 1]], [[0, 0]], [[1e-9, 5.0]], 2.0),
    ],
)
def test_differences_are_relative_to_the_range_and_ties_are_none(
    space: Any, expected: Any, found: Any, scores: Any, result: float
) -> None:
    scores = None if scores is None else np.array(scores, np.float64)
    assert difference(space, np.array(expected), np.array(found), scores) == pytest.approx(result, rel=1e-6)


@pytest.mark.slow
def test_export_is_a_command(reach: Run, exported: Export, tmp_path: Path) -> None:
    out = tmp_path / "cli.frobs"
    command = [
        sys.executable,
        "-W",
        "error",
        "-m",
        "frobs_cli",
        "export",
        str(reach.path),
        "--out",
        str(out),
        "--json",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert all(line.startswith("exporting (") for line in done.stderr.splitlines())
    found = json.loads(done.stdout)
    assert found["bundle"] == str(out)
    assert found["bytes"] == out.stat().st_size
    assert found["export"]["max_difference"] <= 1e-5
    assert found["latency"]["median"] > 0.0


@pytest.mark.parametrize("arguments", [["."], [REACH, "--pretrained", "--page", "site"]])
def test_trust_is_refused_where_it_has_no_effect(arguments: list[str]) -> None:
    result = CliRunner().invoke(program(), ["export", *arguments, "--trust"], prog_name="frobs")
    assert result.exit_code in (1, 2)
    assert "--trust: this option requires a bundle" in " ".join(result.stderr.split())
