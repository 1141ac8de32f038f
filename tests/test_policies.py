"""Policies by name and by path, experts of version 0.2, and random actions."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_core import load_policy, plugins
from frobs_core.contracts import Expert, Policy
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.kernel.policies import find_policy, is_path, load_expert, make_policy
from frobs_core.plugins import Plugins
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.errors import PluginError, RunError, UnknownNameError, UnknownParameterError

REACH = "frobs/Irb120Reach-v0"
EXPERT = "frobs_tasks_reach.reach.Reach.expert"


@pytest.fixture
def env() -> Iterator[Any]:
    made = gym.make_vec(REACH, num_envs=2)
    yield made
    made.close()


@pytest.fixture
def alone() -> Iterator[Plugins]:
    """The core without plugins."""
    with plugins.isolated(Plugins([])) as found:
        yield found


class Still(Expert):
    """Does not move."""

    def bind(self, env: Any) -> None:
        self._shape = env.action_space.shape

    def act(self, observation: Any, episode_start: Any) -> Any:
        return np.zeros(self._shape)

    def info(self) -> Any:
        return {"phase": np.zeros(self._shape[0], int)}


class StillIn02(Expert):
    """Does not move, as an expert was written for version 0.2."""

    def __init__(self, env: Any) -> None:
        self.shape = env.action_space.shape

    def act(self, episode_start: Any) -> Any:  # type: ignore[override]
        return np.full(self.shape, float(episode_start[0]))


def test_random_actions_repeat_with_the_seed_and_leave_the_action_space_alone(env: Any) -> None:
    env.action_space.seed(7)
    first, start = env.action_space.sample(), np.ones(2, bool)
    env.action_space.seed(7)
    one, same, other = (load_policy("random", env, seed=seed) for seed in (1, 1, 2))
    action = one.act(None, start)
    assert env.action_space.contains(action)
    assert np.array_equal(action, same.act(None, start))
    assert not np.array_equal(action, other.act(None, start))
    assert not np.array_equal(action, one.act(None, start))
    assert np.array_equal(env.action_space.sample(), first)


def test_an_expert_acts_by_name(env: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EXPERT, f"{__name__}:Still")
    policy = load_policy("expert", env)
    assert policy.act(None, np.ones(2, bool)).shape == env.action_space.shape
    assert policy.info()["phase"].shape == (2,)
    policy.close()
    policy.close()


def test_an_environment_without_an_expert_says_so(env: Any) -> None:
    with pytest.raises(RunError, match=f"the task of {REACH} has no scripted expert"):
        load_policy("expert", env)


def test_an_expert_of_version_0_2_acts_with_a_warning(env: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(EXPERT, f"{__name__}:StillIn02")
    with pytest.warns(
        FrobsDeprecationWarning, match=r"StillIn02.*use bind\(env\) and act\(observation, episode_start\)"
    ):
        policy = load_policy("expert", env)
    assert policy.act(None, np.ones(2, bool)).tolist() == np.ones(env.action_space.shape).tolist()


@pytest.mark.filterwarnings("ignore::frobs_core.deprecation.FrobsDeprecationWarning")
def test_load_expert_is_found_where_version_0_2_had_it() -> None:
    from frobs_core.interfaces import load_expert as moved

    assert moved is load_expert


@pytest.mark.parametrize("cls", [Still, StillIn02])
@pytest.mark.filterwarnings("ignore::frobs_core.deprecation.FrobsDeprecationWarning")
def test_load_expert_returns_an_expert_that_acts_as_in_version_0_2(
    env: Any, cls: type[Expert], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert load_expert(env.unwrapped) is None
    monkeypatch.setattr(EXPERT, f"{__name__}:{cls.__name__}")
    expert = load_expert(env.unwrapped)
    assert isinstance(expert, cls)
    assert expert.act(np.zeros(2, bool)).tolist() == np.zeros(env.action_space.shape).tolist()


def test_load_expert_warns(env: Any) -> None:
    with pytest.warns(FrobsDeprecationWarning, match="use frobs_core.load_policy"):
        load_expert(env)


def test_an_unknown_name_lists_the_names_and_what_to_install(alone: Plugins) -> None:
    with pytest.raises(UnknownNameError, match=r"Available: expert, random. To install it: pip install .*frobs-train"):
        make_policy("pretrained")


@pytest.mark.parametrize("name", ["teleop", "teleop:keyboard"])
def test_a_policy_with_two_parts_in_its_name_is_found_by_it(name: str, alone: Plugins) -> None:
    with pytest.raises(UnknownNameError, match=rf"{name}.*To install it: pip install .*frobs-view"):
        make_policy(name)
    with plugins.isolated(Plugins()):
        assert find_policy(name).name == name
        assert find_policy(f"{name}").load().__module__ == "frobs_view.teleop"


def test_a_path_says_what_to_install_if_nothing_opens_it(alone: Plugins, tmp_path: Path) -> None:
    for path in (tmp_path, "runs/first", "model.zip"):
        with pytest.raises(
            PluginError, match=r"to open run folders, bundles and model files: pip install .*frobs-train"
        ):
            make_policy(path)


def test_a_policy_without_the_option_names_the_ones_it_has() -> None:
    with pytest.raises(UnknownParameterError, match=r"policy 'random' has no parameter 'checkpoint'. Available: seed"):
        make_policy("random", checkpoint="best")


@pytest.mark.parametrize("name", ["runs/first", "./first", "reach.frobs", "model.zip", Path("first")])
def test_a_name_with_a_slash_or_a_dot_is_a_path(name: str | Path) -> None:
    assert is_path(name)
    assert find_policy(name).name == "trained"


@pytest.mark.parametrize("name", ["expert", "frobs-core:random"])
def test_other_names_are_looked_up(name: str) -> None:
    assert not is_path(name)
    assert find_policy(name).name == name.rpartition(":")[2]


def test_a_policy_that_opens_paths_has_no_name_of_its_own() -> None:
    with pytest.raises(PluginError, match="write the path instead of the name"):
        find_policy("trained")


class Opened(Policy):
    """Keeps its path."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def act(self, observation: Any, episode_start: Any) -> Any:
        raise NotImplementedError


def test_the_policy_with_the_longest_fitting_ending_opens_a_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def record(name: str, *suffixes: str) -> PolicyRecord:
        return PolicyRecord(name=name, summary="", entry_point=f"{__name__}:Opened", suffixes=suffixes)

    offered = {"files": record("files", ""), "tapes": record("tapes", ".tape"), "folders": record("folders", "/")}
    monkeypatch.setattr(plugins, "records", lambda kind: offered)
    assert find_policy("a.tape") is offered["tapes"]
    assert find_policy("a.other") is offered["files"]
    assert find_policy(tmp_path) is offered["folders"]
    policy = make_policy("a.tape")
    assert isinstance(policy, Opened)
    assert policy.path == Path("a.tape")
    offered["frobs-core:again"] = record("again", ".tape")
    with pytest.raises(PluginError, match="opened by several policies: tapes, frobs-core:again"):
        find_policy("a.tape")
