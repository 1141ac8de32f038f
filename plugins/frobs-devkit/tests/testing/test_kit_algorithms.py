"""Faults in an algorithm: a sound small one with one thing broken."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import Algorithm
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import CheckpointError, UnknownParameterError
from frobs_devkit.testing import NotApplicable, check_algorithm, pytest_checks, run_checks


class Drift(Algorithm):
    """Learns nothing useful, but keeps the contract: a matrix that training moves, with momentum."""

    iteration = 100
    action = 0.0

    def __init__(self, env: Any, config: Mapping[str, Any], seed: int) -> None:
        self.env, self.config = env, dict(config)
        self.observation_space, self.action_space = env.single_observation_space, env.single_action_space
        self.low, self.high = self.action_space.low, self.action_space.high
        self.rng = np.random.default_rng(seed)
        self.matrix = self.rng.normal(size=(*self.observation_space.shape, 1))
        self.velocity = np.zeros_like(self.matrix)
        self.steps = 0

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        for key in config:
            if key != "rate":
                raise UnknownParameterError("algorithm 'drift'", key, ["rate"])
        return {"rate": 0.1, **config}

    def train(self, steps: int, monitor: Any) -> None:
        if self.steps == 0:
            self.env.reset()
        while self.steps < steps:
            for _ in range(self.iteration // self.env.num_envs):
                noise = 0.01 * self.rng.normal(size=self.env.action_space.shape)
                self.see(*self.env.step(self.scale(self.action + noise)))
            self.velocity = 0.5 * self.velocity + self.config["rate"] * self.rng.normal(size=self.matrix.shape)
            self.matrix += self.velocity
            self.steps += self.iteration
            go_on = monitor.on_progress(self.steps, {"drift/size": 1.0})
            monitor.offer_checkpoint(self.steps, self.save)
            if not go_on:
                return

    def see(self, observation: Any, reward: Any, terminated: Any, truncated: Any, info: Any) -> None:
        """Learn nothing from a step."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> Any:
        noise = 0.0 if deterministic else np.random.default_rng().normal(size=1)
        return self.scale(np.tanh((observation[:, :, None] * self.matrix).sum(1) + noise)), None

    def scale(self, raw: Any) -> Any:
        return (0.5 * (self.low + self.high) + 0.5 * (self.high - self.low) * raw).astype(np.float32)

    def save(self, folder: Path, previous: Path | None = None) -> None:
        told = {
            "matrix": self.matrix.tolist(),
            "velocity": self.velocity.tolist(),
            "steps": self.steps,
            "config": self.config,
            "bounds": [self.low.tolist(), self.high.tolist()],
        }
        (folder / "drift.json").write_text(json.dumps({**told, "random": self.rng.bit_generator.state}))

    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        try:
            told = json.loads((folder / "drift.json").read_text())
        except (OSError, ValueError) as error:
            raise CheckpointError(f"{folder} cannot be read: {error}") from error
        self = cls.__new__(cls)
        self.env, self.steps, self.config = env, told.get("steps", 0), told.get("config", {})
        self.rng = np.random.default_rng()
        if "random" in told:
            self.rng.bit_generator.state = told["random"]
        self.matrix = np.array(told["matrix"])
        self.low, self.high = np.array(told.get("bounds", [[-2.0], [2.0]]))
        self.velocity = np.array(told.get("velocity", 0.0 * self.matrix))
        return self


class LearnsNothingMore(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        super().train(steps // 2, monitor)


class StepsFall(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        super().train(steps, monitor)
        monitor.on_progress(50, {})
        monitor.on_progress(400, {})


class NeverOffers(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        monitor.offer_checkpoint = lambda *_: None
        super().train(steps, monitor)


class LeavesTheSpace(Drift):
    def predict(self, *arguments: Any, **keywords: Any) -> Any:
        return 5 * super().predict(*arguments, **keywords)[0], None


class NeverRepeats(Drift):
    def predict(self, observation: Any, *arguments: Any, **keywords: Any) -> Any:
        return super().predict(observation, deterministic=False)


class SeedIgnored(Drift):
    def __init__(self, env: Any, config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, np.random.SeedSequence().entropy)


class OneSeed(Drift):
    def __init__(self, env: Any, config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, 5)


class SavesInFloat16(Drift):
    def save(self, folder: Path, previous: Path | None = None) -> None:
        (folder / "drift.json").write_text(json.dumps({"matrix": self.matrix.astype(np.float16).tolist()}))


class ForgetsItsGenerator(Drift):
    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        self = super().load(folder, env)
        self.rng = np.random.default_rng()
        return self


class ForgetsItsGeneratorInLongIterations(ForgetsItsGenerator):
    iteration = 1000


class ForgetsItsMomentum(Drift):
    iteration = 1000

    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        self = super().load(folder, env)
        self.velocity = 0.0 * self.velocity
        return self


class ForgetsItsSteps(Drift):
    iteration = 1000

    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        self = super().load(folder, env)
        self.steps = 1 if env is not None else 0
        return self


class CountsOneEnvironment(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        tell = monitor.on_progress
        monitor.on_progress = lambda steps, metrics: tell(steps // 2, metrics)
        super().train(2 * steps, monitor)


class ActsOutside(Drift):
    @property
    def action(self) -> float:  # type: ignore[override]
        return 3.0 if self.low[0] < 0.0 else 0.0


class GoesOnSilently(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        super().train(steps, monitor)
        while self.steps < steps:
            self.env.step(np.zeros(self.env.action_space.shape, np.float32))
            self.steps += 2


class NeverStopsInLongIterations(Drift):
    iteration = 5000

    def train(self, steps: int, monitor: Any) -> None:
        tell = monitor.on_progress
        monitor.on_progress = lambda *told: tell(*told) or True
        super().train(steps, monitor)


class LeavesTheSpaceOnceTrained(Drift):
    def predict(self, *arguments: Any, **keywords: Any) -> Any:
        actions, state = super().predict(*arguments, **keywords)
        return (5 if self.steps else 1) * actions, state


class LeavesTheSpaceFarOut(Drift):
    def predict(self, observation: Any, *arguments: Any, **keywords: Any) -> Any:
        actions, state = super().predict(observation, *arguments, **keywords)
        return np.where(np.abs(observation).max(axis=1, keepdims=True) > 5.0, np.float32(9.0), actions), state


class PredictsFromItsGenerator(Drift):
    def predict(self, *arguments: Any, **keywords: Any) -> Any:
        self.rng.normal()
        return super().predict(*arguments, **keywords)


class LearnsFromPredictions(Drift):
    def predict(self, *arguments: Any, **keywords: Any) -> Any:
        found = super().predict(*arguments, **keywords)
        self.velocity += 1e-3
        return found


class SavesObjects(Drift):
    def save(self, folder: Path, previous: Path | None = None) -> None:
        super().save(folder)
        np.savez(folder / "rest.npz", rest=np.array([{"a": 1}], dtype=object))


class Climbs(Drift):
    """Goes where the reward falls."""

    def train(self, steps: int, monitor: Any) -> None:
        super().train(steps, monitor)
        if self.matrix.shape == (1, 1):
            self.matrix[...] = -3.0


class TellsTwice(Drift):
    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        self = super().load(folder, env)
        self.steps -= 100 if env is not None else 0
        return self


class ResetsWithASeed(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        if self.steps == 0:
            self.env.reset(seed=7)
        super().train(steps, monitor)


class Discounts(Drift):
    """Moves with the rewards and the final observations, discounted."""

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        given = dict(config)
        return {"gamma": given.pop("gamma", 0.9), **super().resolve_config(given)}

    def see(self, observation: Any, reward: Any, terminated: Any, truncated: Any, info: Any) -> None:
        after = np.where(terminated[:, None], 0.0, observation)
        self.bootstrap(np.where(truncated[:, None], 0.0, after))
        for i in np.flatnonzero(truncated):
            self.bootstrap(np.asarray(info["final_obs"][i])[None])

    def bootstrap(self, values: Any) -> None:
        self.velocity += 1e-3 * self.config["gamma"] * values.sum(0)[:, None]


class DiscountsNothing(Discounts):
    def bootstrap(self, values: Any) -> None:
        self.velocity += 1e-3 * values.sum(0)[:, None]


class ForgetsTheFinalObservation(Discounts):
    def see(self, observation: Any, reward: Any, terminated: Any, truncated: Any, info: Any) -> None:
        self.bootstrap(np.where(terminated[:, None], 0.0, observation))


class BootstrapsThroughTermination(Discounts):
    def see(self, observation: Any, reward: Any, terminated: Any, truncated: Any, info: Any) -> None:
        super().see(observation, reward, np.zeros_like(terminated), truncated, info)


class ManySteps(Drift):
    """Learns the values of two actions from the rewards of three steps and the value after them, in a table."""

    n = 3

    def __init__(self, env: Any, config: Mapping[str, Any], seed: int) -> None:
        self.env, self.config, self.steps = env, dict(config), 0
        self.observation_space, self.action_space = env.single_observation_space, env.single_action_space
        self.rng = np.random.default_rng(seed)
        self.table = np.zeros((2, 2))

    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        return {"gamma": 0.9, **config}

    def train(self, steps: int, monitor: Any) -> None:
        shown = self.env.reset()[0]
        past: list[list[Any]] = [[] for _ in shown]
        while self.steps < steps:
            actions = self.rng.integers(2, size=len(shown))
            following, rewards, terminated, truncated, info = self.env.step(actions)
            for row, steps_of_row in enumerate(past):
                steps_of_row.append((self.key(shown[row]), actions[row], rewards[row]))
                end = terminated[row] or truncated[row]
                last = info["final_obs"][row] if end else following[row]
                while steps_of_row and (end or len(steps_of_row) == self.n):
                    self.learn(steps_of_row, 0.0 if terminated[row] else self.table[self.key(last)].max())
                    del steps_of_row[0]
            shown = following
            self.steps += len(shown)
        monitor.on_progress(self.steps, {"table/mean": float(self.table.mean())})

    def learn(self, steps: list[Any], value: float) -> None:
        gamma = self.config["gamma"]
        worth = sum(gamma**k * reward for k, (_, _, reward) in enumerate(steps)) + self.factor(len(steps)) * value
        self.table[steps[0][:2]] += 0.1 * (worth - self.table[steps[0][:2]])

    def factor(self, n: int) -> float:
        return float(self.config["gamma"] ** n)

    def key(self, observation: Any) -> int:
        return int(observation[0] > 0.0)

    def predict(self, observation: Any, *arguments: Any, **keywords: Any) -> Any:
        return np.array([self.table[self.key(row)].argmax() for row in observation]), None


class DiscountsOnce(ManySteps):
    """Discounts the value after three steps as if it were that after one."""

    def factor(self, n: int) -> float:
        return float(self.config["gamma"])


class ExportsUnscaled(Drift):
    """Forgets the action space in the graph."""

    def export_onnx(self) -> bytes:
        return linear(self.matrix)


class Adapts(Drift):
    """Continues with other settings."""

    @classmethod
    def load_with(cls, folder: Path, env: Any, config: Mapping[str, Any]) -> Any:
        self = cls.load(folder, env)
        self.config = dict(config)
        return self


class KeepsItsSettings(Drift):
    """Continues with the settings of the checkpoint."""

    @classmethod
    def load_with(cls, folder: Path, env: Any, config: Mapping[str, Any]) -> Any:
        return cls.load(folder, env)


class SharesAnOldFile(Drift):
    """Believes that a file of the previous checkpoint has not changed."""

    def save(self, folder: Path, previous: Path | None = None) -> None:
        super().save(folder)
        if previous is not None:
            (folder / "drift.json").write_bytes((previous / "drift.json").read_bytes())


def linear(matrix: Any) -> bytes:
    """Return a graph that multiplies observations by a matrix."""
    onnx = pytest.importorskip("onnx")
    make, kind = onnx.helper, onnx.TensorProto.FLOAT
    weights = onnx.numpy_helper.from_array(matrix.astype(np.float32), "weights")
    shapes = {"observation": ["batch", len(matrix)], "action": ["batch", 1]}
    observation, action = (make.make_tensor_value_info(name, kind, shape) for name, shape in shapes.items())
    nodes = [make.make_node("MatMul", ["observation", "weights"], ["raw"]), make.make_node("Tanh", ["raw"], ["action"])]
    graph = make.make_graph(nodes, "policy", [observation], [action], [weights])
    model = make.make_model(graph, opset_imports=[make.make_opsetid("", 17)], ir_version=8)
    return bytes(model.SerializeToString())


class IgnoresItsRate(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        self.config["rate"] = 0.1
        super().train(steps, monitor)


class TrainsOnceMore(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        super().train(steps if self.steps < steps else self.steps + 1, monitor)


class ScalesWithoutTheCenter(Drift):
    """Right wherever the space is symmetric."""

    def scale(self, raw: Any) -> Any:
        return (self.high * raw).astype(np.float32)


class KeepsTheState(Drift):
    """Remembers the last observations, and does not forget them where an episode starts."""

    def predict(self, observation: Any, state: Any = None, *arguments: Any, **keywords: Any) -> Any:
        seen = observation if state is None else 0.5 * (observation + state[0])
        return super().predict(seen, *arguments, **keywords)[0], (observation,)


class DrawsFromItsGenerator(Drift):
    def predict(self, *arguments: Any, deterministic: bool = True, **keywords: Any) -> Any:
        if not deterministic:
            self.rng.normal()
        return super().predict(*arguments, deterministic=deterministic, **keywords)


class KeepsHalfOfThePolicy(Drift):
    def save_policy(self, folder: Path) -> None:
        (folder / "drift.json").write_text(json.dumps({"matrix": (self.matrix / 2).tolist()}))


class AnythingGoes(Drift):
    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        return {"rate": 0.1, **config}


class ResolvesTwice(Drift):
    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        return {"rate": config.get("rate", 0.1) / 2}


class Halves(Drift):
    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        resolved = super().resolve_config(config)
        return {"rate": resolved["rate"] / 2}


class Function(Drift):
    @classmethod
    def resolve_config(cls, config: Mapping[str, Any]) -> dict[str, Any]:
        return {"rate": 0.1, "schedule": len}


class Pickles(Drift):
    def save(self, folder: Path, previous: Path | None = None) -> None:
        super().save(folder)
        (folder / "rest.pkl").write_bytes(pickle.dumps(Path(folder)))


class DamageIsAnyError(Drift):
    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        json.loads((folder / "drift.json").read_text())
        return super().load(folder, env)


class DamageIsIgnored(Drift):
    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        self = cls.__new__(cls)
        self.matrix = np.zeros((3, 1))
        return self


class SpaceOfTheBatch(Drift):
    def __init__(self, env: Any, config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, seed)
        self.observation_space = env.observation_space


class NeverStops(Drift):
    def train(self, steps: int, monitor: Any) -> None:
        tell = monitor.on_progress
        monitor.on_progress = lambda *told: tell(*told) or True
        super().train(steps, monitor)


class DependsOnTheBatch(Drift):
    def predict(self, observation: Any, *arguments: Any, **keywords: Any) -> Any:
        actions, state = super().predict(observation, *arguments, **keywords)
        return (actions * np.float32(0.9 if len(observation) == 1 else 1.0)), state


class ForgetsWithAnEnvironment(Drift):
    @classmethod
    def load(cls, folder: Path, env: Any = None) -> Any:
        self = super().load(folder, env)
        self.matrix = self.matrix if env is None else self.matrix * 0.5
        return self

    def train(self, steps: int, monitor: Any) -> None:
        if self.steps:
            self.matrix = self.matrix * 2.0  # what was forgotten comes back
        super().train(steps, monitor)


def record(cls: type, **keywords: Any) -> AlgorithmRecord:
    return AlgorithmRecord(name="drift", summary="", entry_point=f"{__name__}:{cls.__name__}", **keywords)


test_a_sound_algorithm_with_a_discount_passes = pytest_checks(check_algorithm(record(Discounts)))
test_a_sound_algorithm_passes = pytest_checks(check_algorithm(record(Drift)), allow_inconclusive=False)


DISCRETE = ("Discrete",)


def find(cls: type, check: str) -> Any:
    spaces = {"action_spaces": DISCRETE} if issubclass(cls, ManySteps) else {}
    return next(c for c in check_algorithm(record(cls, **spaces)) if c.name == check)


def test_several_steps_may_be_summed() -> None:
    find(ManySteps, "rewards_are_discounted_per_step").run()


def test_settings_may_change_during_training() -> None:
    find(Adapts, "settings_can_change").run()


@pytest.mark.parametrize(
    ("faulty", "check", "told"),
    [
        (LearnsNothingMore, "learns", "for 200 of 300 steps"),
        (StepsFall, "learns", "reported steps decrease"),
        (NeverOffers, "learns", "never calls offer_checkpoint"),
        (LeavesTheSpace, "predicts_in_the_space", "is not in Box"),
        (NeverRepeats, "predicts_in_the_space", "repeated deterministic prediction"),
        (SeedIgnored, "same_seed_repeats", "again with the same seed"),
        (OneSeed, "same_seed_repeats", "two different seeds give bit-identical"),
        (SavesInFloat16, "load_equals_save", "loaded algorithm"),
        (ForgetsItsGenerator, "continues_exactly", "resumed training run"),
        (TellsTwice, "continues_exactly", "the resumed algorithm reports the step counts .* instead of"),
        (ForgetsItsGeneratorInLongIterations, "continues_exactly", "resumed training run"),
        (ForgetsItsMomentum, "continues_exactly", "resumed training run"),
        (ForgetsItsSteps, "continues_exactly", "the resumed algorithm reports the step counts .* instead of"),
        (CountsOneEnvironment, "steps_count_every_environment", "2 environments took"),
        (ActsOutside, "steps_count_every_environment", "an action outside the action space"),
        (GoesOnSilently, "stops_when_told", "training continued"),
        (NeverStopsInLongIterations, "stops_when_told", "training continued"),
        (LeavesTheSpaceOnceTrained, "predicts_in_the_space", "is not in Box"),
        (LeavesTheSpaceFarOut, "predicts_in_the_space", "is not in Box"),
        (PredictsFromItsGenerator, "predicting_changes_nothing", "after a training run with"),
        (DrawsFromItsGenerator, "predicting_changes_nothing", "after a training run with"),
        (LearnsFromPredictions, "predicting_changes_nothing", "after a training run with"),
        (SavesObjects, "files_execute_nothing", "an array of Python objects"),
        (KeepsTheState, "predicts_in_the_space", "with the state of other episodes"),
        (IgnoresItsRate, "settings_count", "other values of rate"),
        (TrainsOnceMore, "training_ends_at_its_steps", "takes 100 more steps"),
        (BootstrapsThroughTermination, "discount_ends_with_an_episode", "every step terminates"),
        (DiscountsOnce, "rewards_are_discounted_per_step", "gamma to the power of n"),
        (SharesAnOldFile, "continues_exactly", "report"),
        (ExportsUnscaled, "exported_policy_predicts", "actions of the exported policy"),
        (KeepsItsSettings, "settings_can_change", "other values of rate"),
        (ScalesWithoutTheCenter, "training_does_not_harm", "scale actions with low and high"),
        (Climbs, "training_does_not_harm", "changes the mean reward"),
        (KeepsHalfOfThePolicy, "policy_alone_predicts", "separately saved"),
        (AnythingGoes, "unknown_settings_refused", "must raise UnknownParameterError"),
        (ResolvesTwice, "settings_resolve_once", "changes them"),
        (Function, "settings_resolve_once", "schedule"),
        (Pickles, "files_execute_nothing", r"rest.pkl is a pickle that imports pathlib"),
        (DamageIsAnyError, "missing_files_are_told", "JSONDecodeError"),
        (
            DamageIsIgnored,
            "missing_files_are_told",
            "is cut in half does not raise an error; it must raise CheckpointError",
        ),
    ],
)
def test_the_kit_catches(faulty: type, check: str, told: str) -> None:
    from frobs_devkit.testing import CheckFailure

    with pytest.raises(CheckFailure, match=told):
        find(faulty, check).run()


SEPARATE = [
    (SpaceOfTheBatch, "spaces_are_kept"),
    (LearnsNothingMore, "learns"),
    (NeverStops, "stops_when_told"),
    (ActsOutside, "steps_count_every_environment"),
    (DependsOnTheBatch, "predicts_in_the_space"),
    (ResetsWithASeed, "resets_without_a_seed"),
    (PredictsFromItsGenerator, "predicting_changes_nothing"),
    (DiscountsNothing, "discount_counts"),
    (ForgetsTheFinalObservation, "final_observations_count"),
    (BootstrapsThroughTermination, "discount_ends_with_an_episode"),
    (IgnoresItsRate, "settings_count"),
    (TrainsOnceMore, "training_ends_at_its_steps"),
    (Climbs, "training_does_not_harm"),
    (ExportsUnscaled, "exported_policy_predicts"),
    (KeepsItsSettings, "settings_can_change"),
    (OneSeed, "same_seed_repeats"),
    (ForgetsWithAnEnvironment, "load_equals_save"),
    (ForgetsItsGenerator, "continues_exactly"),
    (KeepsHalfOfThePolicy, "policy_alone_predicts"),
    (AnythingGoes, "unknown_settings_refused"),
    (Halves, "settings_resolve_once"),
    (Pickles, "files_execute_nothing"),
    (DamageIsAnyError, "missing_files_are_told"),
]
"""Faults that one check catches, and no other."""


@pytest.mark.slow
@pytest.mark.parametrize(("faulty", "check"), SEPARATE)
def test_no_other_check_catches(faulty: type, check: str) -> None:
    report = run_checks(check_algorithm(record(faulty)))
    assert [result.name for result in report.failed] == [check]


def test_every_check_has_a_fault_that_no_other_catches() -> None:
    elsewhere = {"rewards_are_discounted_per_step"}  # by an algorithm that fulfills nothing else of the contract
    assert {check for _, check in SEPARATE} | elsewhere == {check.name for check in check_algorithm(record(Drift))}


def test_other_action_spaces_need_an_environment() -> None:
    (check,) = check_algorithm(record(Drift, action_spaces=("Text",)))
    with pytest.raises(NotApplicable):
        check.run()
