"""Environments that return numbers that are not finite, never end, fail, or do not follow Gymnasium's interface."""

from __future__ import annotations

import json
import math
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium import spaces

from frobs_core.util.errors import FrobsError, NonFiniteValueError
from frobs_train import Run, RunConfig, evaluate, record_video, resolve_config, train
from frobs_train.environment_checks import Place, first_not_finite
from frobs_train.environments import make_env, make_vector_env
from frobs_train.errors import EndlessEpisodeError, EnvironmentFaultError, TrainingError
from frobs_train.export.export import export
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.training.interrupts import TrainingInterrupt

ID = "FrobsTests/Odd-v0"
FAST: dict[str, dict[str, Any]] = {
    "ppo": {"n_steps": 16, "n_epochs": 1, "batch_size": 16},
    "dqn": {"learning_starts": 8, "train_freq": 4},
    "td3": {"learning_starts": 8},
    "sac": {"learning_starts": 8},
}


class OddEnv(gym.Env[Any, Any]):
    """An environment with one fault, which occurs at the third step of its second episode."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 10}  # type: ignore[misc]

    def __init__(
        self, fault: str = "", value: float = math.nan, discrete: bool = False, render_mode: str | None = None
    ) -> None:
        self.render_mode = render_mode
        self.fault, self.value = fault, value
        self.observation_space = spaces.Box(-math.inf, math.inf, (2,), np.float32)
        self.action_space = spaces.Discrete(2) if discrete else spaces.Box(-1.0, 1.0, (1,), np.float32)
        if fault == "dict":
            self.observation_space = spaces.Dict({"a": self.observation_space, "b": spaces.Box(0, 1, (1, 2))})
        self.episode = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.time, self.episode = 0, self.episode + 1
        return self._observation(), {}

    def step(self, action: Any) -> Any:
        self.time += 1
        wrong = self._wrong()
        if wrong and self.fault == "crash":
            raise ZeroDivisionError("the user's own bug.")
        reward = self.value if wrong and self.fault == "reward" else 1.0
        info = {"is_success": self.value if self.fault == "success" else 1.0}
        return self._observation(), reward, False, self.fault != "endless" and self.time >= 5, info

    def render(self) -> Any:
        return np.zeros((4, 4, 3), np.uint8)

    def _wrong(self) -> bool:
        return self.episode == 2 and self.time == 3

    def _observation(self) -> Any:
        last = self.episode == 2 and self.time == 5
        first = self.episode == 2 and self.time == 0
        wrong = {"observation": self._wrong(), "dict": self._wrong(), "final": last, "first": first}.get(self.fault)
        found = np.array([0.0, self.value if wrong else 0.0], np.float32)
        return {"a": np.zeros(2, np.float32), "b": found[None]} if self.fault == "dict" else found


gym.register(ID, OddEnv)  # type: ignore[arg-type]

FAULTS = {
    "observation": r"observation\[1\] is {value} in environment [01], at step 3 of episode 2",
    "dict": r"observation\['b'\]\[0, 1\] is {value} in environment [01], at step 3 of episode 2",
    "final": r"observation\[1\] is {value} in environment [01], at step 5 of episode 2",
    "first": r"observation\[1\] is {value} in environment [01], at the reset of episode 2",
    "reward": r"the reward is {value} in environment [01], at step 3 of episode 2",
    "success": r"the metric 'is_success' is {value} in environment [01], at step 5 of episode 1",
}


def config(fault: str, algorithm: str = "ppo", **changes: Any) -> RunConfig:
    kwargs = {"fault": fault, "discrete": algorithm == "dqn", **changes.pop("kwargs", {})}
    flags = {"algorithm": algorithm, "num_envs": 2, "steps": 64, "seed": 0}
    settings = [f"algorithm_config={json.dumps(FAST[algorithm])}", f"environment_kwargs={json.dumps(kwargs)}"]
    return resolve_config(ID, flags=flags, settings=settings).model_copy(update=changes)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_number_that_is_not_finite_is_named(fault: str, value: float) -> None:
    env = EpisodeRecorder(make_vector_env(ID, 2, {"fault": fault, "value": value}), lambda _: None)

    def play() -> None:
        env.reset(seed=0)
        for _ in range(11):
            env.step(env.action_space.sample())

    with pytest.raises(NonFiniteValueError, match=FAULTS[fault].format(value=value)) as caught:
        play()
    assert str(caught.value).startswith(f"environment '{ID}' returned a value that is not finite: ")


@pytest.mark.parametrize("fault", ["observation", "reward", "success"])
@pytest.mark.parametrize("algorithm", FAST)
def test_training_stops_at_the_first_number_that_is_not_finite(algorithm: str, fault: str, tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match=r"is not finite.*Fix the cause") as caught:
        train(config(fault, algorithm), tmp_path / "run")
    assert isinstance(caught.value.__cause__, NonFiniteValueError)


def test_the_reward_term_and_the_observation_term_are_named() -> None:
    env = EpisodeRecorder(make_vector_env("frobs/Irb120Reach-v0", 2, {}), lambda _: None)
    base: Any = env.unwrapped
    env.reset(seed=0)
    observation, rewards, _, _, info = env.step(env.action_space.sample())
    observation[1, -1] = math.nan
    with pytest.raises(
        NonFiniteValueError, match=rf"observation\[\d+\] is nan \(term '{list(base.observations.terms)[-1]}'\)"
    ):
        env.checks.check_observation(observation)
    term = next(name for name in info if name.startswith("frobs/reward/"))
    rewards[1] = info[term][1] = math.nan
    with pytest.raises(NonFiniteValueError, match=rf"reward is nan \({term}\) in environment 1"):
        env.checks.count_step(rewards, info)
    env.close()


def test_actions_that_are_not_finite_are_rejected_before_the_environment_moves() -> None:
    env = EpisodeRecorder(make_vector_env(ID, 2, {}), lambda _: None)
    env.reset(seed=0)
    with pytest.raises(
        NonFiniteValueError, match=r"the policy returned .*action\[0\] is nan in environment 1, at step 1"
    ):
        env.step(np.array([[0.0], [math.nan]], np.float32))
    assert env.steps == 0


def test_infinite_bounds_do_not_allow_infinite_values() -> None:
    assert spaces.Box(-math.inf, math.inf, (1,)).contains(np.array([math.inf], np.float32))
    assert first_not_finite(np.array([[0.0], [math.inf]])) == Place(1, None, (0,), math.inf)
    assert first_not_finite({"a": np.ones(2), "b": {"c": np.array([1.0, math.inf])}}) == Place(1, "b.c", (), math.inf)
    assert first_not_finite(np.array([[2**40, 255]])) is None
    assert first_not_finite((np.array(["text"]), np.ones(1))) is None


def diverge(run: Run) -> None:
    """Write weights that are not finite to the newest checkpoint, as FRobs 0.1 could do."""
    folder = run.checkpoints[-1].path
    weights = th.load(folder / "algorithm/policy.pt", weights_only=True)
    weights[next(name for name in weights if "weight" in name)][0, 0] = math.nan
    th.save(weights, folder / "algorithm/policy.pt")
    from frobs_train.runs import checksums

    checksums.write_checksums(
        folder, [path for path in folder.rglob("*") if path.is_file() and path.name != checksums.NAME]
    )


@pytest.mark.parametrize("algorithm", ["ppo", "dqn"])
def test_a_network_that_has_diverged_is_not_used(algorithm: str, tmp_path: Path) -> None:
    run = train(config("", algorithm), tmp_path / "run")
    diverge(run)
    acts: tuple[Callable[[Run], object], ...] = (lambda run: evaluate(run, 2), export, record_video)
    for act in acts:
        with pytest.raises(
            NonFiniteValueError, match=r"policy\.pt contains a network that has diverged: the weight '.*' is"
        ):
            act(run)
    assert not list(run.path.glob("policy.frobs")) + list(run.path.glob("evaluations/*"))


@pytest.mark.parametrize("algorithm", ["ppo", "dqn", "td3"])
def test_training_stops_if_the_network_diverges(algorithm: str, tmp_path: Path) -> None:
    changed = config("", algorithm, algorithm_config={**FAST[algorithm], "learning_rate": 1e30})
    with pytest.raises(TrainingError, match=r"diverged") as caught:
        train(changed, tmp_path / "run")
    assert "learning_rate" in str(caught.value)


def test_an_endless_episode_ends_an_evaluation(copied: Run, tmp_path: Path) -> None:
    run = train(config("", longest_episode=30), tmp_path / "run")
    endless = Run(run.path, run.config.model_copy(update={"environment_kwargs": {"fault": "endless"}}))
    with pytest.raises(EndlessEpisodeError, match=r"has not ended after 30 steps; give the environment a time limit"):
        evaluate(endless, 2)
    with pytest.raises(EndlessEpisodeError, match="after 40 steps"):
        evaluate(endless, 2, longest_episode=40)
    with pytest.raises(EndlessEpisodeError, match="after 30 steps"):
        record_video(endless, tmp_path / "video.mp4")
    assert not (tmp_path / "video.mp4").exists()
    assert evaluate(run, 2, longest_episode=6).mean_length == 5
    assert evaluate(copied, 2, longest_episode=3).mean_length == 10  # it has a time limit
    limit = [{"name": "gymnasium.wrappers:TimeLimit", "max_episode_steps": 7}]
    limited = RunConfig(**{**endless.config.model_dump(), "wrappers": limit})
    assert evaluate(Run(run.path, limited), 2, longest_episode=3).mean_length == 7


def test_training_warns_once_if_no_episode_ends(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    train(config("endless", longest_episode=10), tmp_path / "run")
    train(config("endless"), tmp_path / "short")
    train(config(""), tmp_path / "ends")
    told = [record.message for record in caplog.records if "has ended after" in record.message]
    assert [message.partition(",")[0] for message in told] == [
        f"No episode of {ID} has ended after {steps} steps" for steps in (16, 32)
    ]


def test_a_signal_ends_an_evaluation_during_training(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    timer = threading.Timer(0.0, os.kill, (os.getpid(), signal.SIGTERM))

    def start(progress: object) -> None:
        if not timer.is_alive() and not timer.finished.is_set():
            timer.interval = 1.0
            timer.start()

    changed = config("endless", longest_episode=10**9, evaluate_every=40, log_every=16, steps=640)
    with pytest.raises(TrainingInterrupt, match="from the checkpoint at step 64"):
        train(changed, tmp_path / "run", start)
    assert "The evaluation after 64 steps was interrupted" in caplog.text


def test_an_exception_names_the_line_in_the_environment(tmp_path: Path) -> None:
    where = (
        rf"environment '{ID}' raised ZeroDivisionError in step\(\): the user's own bug \({__file__}:\d+, in step\)\."
    )
    with pytest.raises(TrainingError, match=where):
        train(config("crash"), tmp_path / "run")
    run = train(config(""), tmp_path / "good")
    crashing = Run(run.path, run.config.model_copy(update={"environment_kwargs": {"fault": "crash"}}))
    for act in (evaluate, record_video):
        with pytest.raises(EnvironmentFaultError, match=where) as caught:
            act(crashing)
        assert isinstance(caught.value.__cause__, ZeroDivisionError)


class Broken(OddEnv):
    """An environment that does not follow Gymnasium's interface."""

    def reset(self, **kwargs: Any) -> Any:
        observation, info = super().reset(**kwargs)
        return {
            "old reset": observation,
            "wrong shape": (np.zeros(3, np.float32), info),
            "wrong type": (np.array(["a", "b"]), info),
            "no array": (None, info),
            "no info": (observation, None),
        }.get(self.fault, (observation, info))

    def step(self, action: Any) -> Any:
        observation, reward, terminated, truncated, info = super().step(action)
        return {
            "old step": (observation, reward, truncated, info),
            "array reward": (observation, np.ones(1), terminated, truncated, info),
            "no reward": (observation, None, terminated, truncated, info),
            "wrong shape later": (np.zeros((2, 1), np.float32), reward, terminated, truncated, info),
        }.get(self.fault, (observation, reward, terminated, truncated, info))


gym.register("FrobsTests/Broken-v0", Broken)  # type: ignore[arg-type]

BROKEN = {
    "old reset": r"returns an array of shape \(2,\) .* from reset\(\).*return observation, \{\} from reset\(\)",
    "no info": r"returns a tuple of 2 elements from reset\(\)",
    "wrong shape": r"observation is an array of shape \(3,\) and type float32, but the space has the shape \(2,\)",
    "wrong type": "type <U1, but the space has the type float32",
    "no array": r"None of type NoneType, but the space has the shape \(2,\)",
    "old step": r"returns a tuple of 4 elements from step\(\).*insert False after done",
    "array reward": r"returns an array of shape \(1,\) .* as reward.*return float\(reward\)",
    "no reward": "returns None of type NoneType as reward",
    "wrong shape later": r"from step\(\).*shape \(2, 1\)",
}


@pytest.mark.parametrize("fault", BROKEN)
def test_violations_of_the_interface_are_named_with_the_fix(fault: str) -> None:
    def play(env: Any) -> None:
        env.reset(seed=0)
        env.step(env.action_space.sample())

    for env in (make_env, lambda *args: make_vector_env(args[0], 2, args[1])):
        with pytest.raises(FrobsError, match=f"environment 'FrobsTests/Broken-v0' .*{BROKEN[fault]}"):
            play(env("FrobsTests/Broken-v0", {"fault": fault}))


def test_observations_outside_their_bounds_cause_one_warning(caplog: pytest.LogCaptureFixture) -> None:
    gym.register("FrobsTests/Outside-v0", lambda: gym.wrappers.TransformObservation(OddEnv(), lambda o: o + 9, spaces.Box(0, 1, (2,))))  # type: ignore[arg-type]  # fmt: skip
    env = make_vector_env("FrobsTests/Outside-v0", 3, {})
    env.reset()
    env.step(env.action_space.sample())
    assert [record.message.partition(" that")[0] for record in caplog.records] == [
        "environment 'FrobsTests/Outside-v0' returns an observation from reset()"
    ]
    del gym.registry["FrobsTests/Outside-v0"]
