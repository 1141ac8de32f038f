"""Recording people: start, keep and discard, the control rate, and taking over from a policy."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.contracts import Operator, Pacer, Policy
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.errors import ParameterValueError, RunError
from frobs_data import Dataset, operated, record, training_arrays
from frobs_data.recording import RecordingInterrupt

REACH = "frobs/Irb120Reach-v0"
INTERRUPT = "interrupt"
STEPS = 6


class Person(Operator):
    """Gives the scripted commands, one at each look, and moves the robot in the scripted steps."""

    commands: Iterator[str]
    moves: Callable[[int], bool] = staticmethod(lambda step: True)
    on_act: Callable[[int], object] = staticmethod(lambda step: None)
    texts: list[str]
    starts: list[bool]
    offered: list[tuple[str, ...]]

    def bind(self, env: Any) -> None:
        self.step = -1
        type(self).texts, type(self).starts, type(self).offered = [], [], []

    def act(self, observation: Any, episode_start: Any) -> Any:
        type(self).starts.append(bool(episode_start[0]))
        type(self).on_act(len(self.starts) - 1)
        return np.full((1, 6), 0.5, np.float32)

    def info(self) -> dict[str, Any]:
        return {"intervention": np.ones(1, bool)}

    @property
    def is_moving(self) -> bool:
        self.step += 1
        return type(self).moves(self.step)

    def offer(self, commands: Sequence[str]) -> None:
        self.offered.append(tuple(commands))

    def command(self) -> str:
        command = next(self.commands)
        if command == INTERRUPT:
            signal.raise_signal(signal.SIGINT)
            return ""
        return command

    def show(self, text: str) -> None:
        self.texts.append(text)


class Remembering(Policy):
    """Acts with zeros, and stores what it is told to remember."""

    remembered: list[Any]

    def bind(self, env: Any) -> None:
        type(self).remembered = []

    def act(self, observation: Any, episode_start: Any) -> Any:
        return np.zeros((1, 6), np.float32)

    def remember(self, action: Any) -> None:
        self.remembered.append(action)


@pytest.fixture(autouse=True)
def people(monkeypatch: pytest.MonkeyPatch) -> None:
    """Offer the policies of this file, with a clock that does not wait."""
    found = plugins.get_record
    own = {
        name: PolicyRecord(name=name, summary="", entry_point=f"{__name__}:{cls.__name__}")
        for name, cls in (("person", Person), ("remembering", Remembering))
    }
    monkeypatch.setattr(plugins, "get_record", lambda kind, name: own.get(name) or found(kind, name))
    monkeypatch.setattr(operated, "Pacer", lambda: Pacer(clock := Clock(), clock.sleep))
    for name, value in (("moves", lambda step: True), ("on_act", lambda step: None)):
        monkeypatch.setattr(Person, name, staticmethod(value))


class Clock:
    """Time that passes only while something waits."""

    def __init__(self) -> None:
        self.time = 0.0

    def __call__(self) -> float:
        return self.time

    def sleep(self, duration: float) -> None:
        self.time += duration


def script(*episodes: str | tuple[int, str]) -> Iterator[str]:
    """Yield commands: for each episode, the number of steps and the decision after them."""
    for episode in episodes:
        yield from ("", "start")
        steps, decision = episode if isinstance(episode, tuple) else (STEPS, episode)
        yield from ("" for _ in range(steps - 1))
        yield decision
        if decision != INTERRUPT:
            yield ""


def recorded(out: Path, *episodes: Any, policy: str = "person", **options: Any) -> Dataset:
    Person.commands = script(*episodes)
    return record(REACH, policy, out=out, max_episode_steps=options.pop("limit", 50), **options)


def test_episodes_are_started_kept_discarded_and_counted(tmp_path: Path) -> None:
    dataset = recorded(tmp_path / "set", (3, "keep"), (4, "discard"), (5, "keep"), episodes=2, seed=7)
    assert [episode.length for episode in dataset.episodes] == [3, 5]
    columns = dataset.columns(["seed", "next.done", "intervention", "next.terminated", "action"])
    assert columns["seed"].tolist() == [7] * 3 + [9] * 5
    assert np.flatnonzero(columns["next.done"]).tolist() == [2, 7]
    assert not columns["next.terminated"].any()
    assert columns["intervention"].all()
    assert (columns["action"] == 0.5).all()
    begins = [text.partition(", kept ")[0] for text in Person.texts if text.endswith("press start")]
    assert begins == ["episode 1 of 2", "episode 2 of 2", "episode 3 of 2"]
    assert [text.partition(", kept ")[2][0] for text in Person.texts if text.endswith("press start")] == ["0", "1", "1"]
    assert "the last episode was discarded" in Person.texts[4]
    assert Person.offered == [("start",), ("keep", "discard")] * 3 + [()]


def test_an_episode_begins_as_its_seed_says(tmp_path: Path) -> None:
    dataset = recorded(tmp_path / "set", (2, "keep"), (2, "discard"), (2, "keep"), episodes=2)
    env = gym.make(f"frobs_core:{REACH}")
    for index, seed in enumerate((0, 2)):
        columns = dataset.columns(["observation.state", "observation.environment_state"], [index])
        first = np.concatenate([columns[name][0] for name in columns])
        np.testing.assert_array_equal(first, env.reset(seed=seed)[0])
    env.close()


def test_an_episode_that_has_ended_waits_for_the_decision(tmp_path: Path) -> None:
    dataset = recorded(tmp_path / "set", (7, "discard"), (7, "keep"), episodes=1, limit=4)
    assert [episode.length for episode in dataset.episodes] == [4]
    assert dataset.columns(["seed"])["seed"].tolist() == [1] * 4
    assert sum("keep or discard it" in text for text in Person.texts) == 2


def test_only_successful_episodes_count_with_success_only(tmp_path: Path) -> None:
    with pytest.raises(RecordingInterrupt, match="keeps 0 whole"):
        recorded(tmp_path / "set", "keep", INTERRUPT, episodes=1, success_only=True)
    assert any("the last episode was discarded" in text for text in Person.texts)


def test_an_interrupt_keeps_what_was_kept(tmp_path: Path) -> None:
    with pytest.raises(RecordingInterrupt, match="keeps 1 whole"):
        recorded(tmp_path / "set", "keep", (3, INTERRUPT), episodes=2)
    assert [episode.length for episode in Dataset(tmp_path / "set").episodes] == [STEPS]


def test_steps_end_at_absolute_deadlines_and_late_ones_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    clock, begun = Clock(), []

    def work(step: int) -> None:
        begun.append(clock.time)
        clock.time += 0.1 if step == 3 else 0.007 + 0.001 * step

    monkeypatch.setattr(Person, "on_act", staticmethod(work))
    monkeypatch.setattr(operated, "Pacer", partial(Pacer, clock, clock.sleep))
    recorded(tmp_path / "set", (6, "keep"), episodes=1)
    # The first step begins the count. The fourth takes 0.1 s, two periods longer than allowed.
    np.testing.assert_allclose(np.diff(begun), [0.047, 0.04, 0.04, 0.12, 0.04])
    assert "2 of 6 deadlines missed" in caplog.text


def test_a_person_takes_over_while_moving_and_the_policy_remembers_it(tmp_path: Path) -> None:
    Person.moves = staticmethod(lambda step: step in (2, 3))
    dataset = recorded(tmp_path / "set", "keep", policy="remembering", episodes=1, takeover="person")
    columns = dataset.columns(["action", "intervention"])
    assert columns["intervention"].tolist() == [False, False, True, True, False, False]
    np.testing.assert_array_equal(columns["action"], np.full((6, 6), 0.5) * columns["intervention"][:, None])
    assert Person.starts == [True, True, False, False, True, True]
    assert len(Remembering.remembered) == 2
    assert dataset.settings is not None
    assert dataset.settings["recordings"][0]["takeover"] == "person"
    env: Any = gym.make(f"frobs_core:{REACH}")
    assert training_arrays(tmp_path / "set", env)["intervention"].tolist() == columns["intervention"].tolist()
    env.close()


def test_a_command_takes_over_until_it_is_given_again(tmp_path: Path) -> None:
    Person.moves = staticmethod(lambda step: False)
    Person.commands = iter(["start", "", "take over", "", "", "take over", "", "keep", ""])
    dataset = record(REACH, "remembering", out=tmp_path / "set", episodes=1, takeover="person")
    assert dataset.columns(["intervention"])["intervention"].tolist() == [False, False, True, True, False]


def test_a_person_acts_in_one_environment(tmp_path: Path) -> None:
    with pytest.raises(ParameterValueError, match="a person acts"):
        record(REACH, "person", out=tmp_path / "set", episodes=1, num_envs=2)


def test_only_a_person_can_take_over(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="'random' is not a policy through which a person acts"):
        record(REACH, "random", out=tmp_path / "set", episodes=1, takeover="random")


def test_a_paced_simulator_keeps_the_rate_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from templates.my_paced_simulator import RECORD

    class Never(Pacer):
        def wait(self, duration: float) -> None:
            pytest.fail("the step has already waited")

    monkeypatch.setattr(operated, "Pacer", Never)
    dataset = recorded(tmp_path / "set", (4, "keep"), episodes=1, simulator=RECORD)
    assert [episode.length for episode in dataset.episodes] == [4]
