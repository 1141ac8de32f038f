"""The kit's checks of policies pass with a good policy, and find what is wrong with others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from frobs_core.contracts import Expert
from frobs_devkit.testing import check_env, check_policy, run_checks

REACH = "frobs_core:frobs/Irb120Reach-v0"


class Counts(Expert):
    """Acts by the number of steps since the start of the episode."""

    def bind(self, env: Any) -> None:
        self._shape = (getattr(env, "num_envs", 1), env.action_space.shape[-1])
        self._steps = np.zeros(self._shape[0])

    def act(self, observation: Any, episode_start: Any) -> Any:
        self.forget(episode_start)
        self._steps += 1
        return np.tile(self._steps[:, None] / 1000, (1, self._shape[1]))

    def forget(self, episode_start: Any) -> None:
        self._steps[episode_start] = 0

    def info(self) -> Any:
        return {"steps": self._steps}


class Remembers(Counts):
    def forget(self, episode_start: Any) -> None:
        pass


class ForgetsAll(Counts):
    def forget(self, episode_start: Any) -> None:
        if episode_start.any():
            self._steps[:] = 0


class Flat(Counts):
    def act(self, observation: Any, episode_start: Any) -> Any:
        return super().act(observation, episode_start)[0]


class TooFar(Counts):
    def act(self, observation: Any, episode_start: Any) -> Any:
        return super().act(observation, episode_start) + 1.0


class Unseeded(Counts):
    def act(self, observation: Any, episode_start: Any) -> Any:
        return np.random.default_rng().uniform(size=self._shape)


class OneFact(Counts):
    def info(self) -> Any:
        return {"steps": 3}


class ClosesOnce(Counts):
    def close(self) -> None:
        del self._steps


@pytest.mark.parametrize(
    ("cls", "failing"),
    [
        (Counts, ()),
        (Remembers, ("episode_start_resets_its_rows",)),
        (ForgetsAll, ("episode_start_resets_its_rows",)),
        (Flat, ("actions_are_in_the_action_space",)),
        (TooFar, ("actions_are_in_the_action_space",)),
        (Unseeded, ("actions_repeat_with_the_seed",)),
        (OneFact, ("actions_are_in_the_action_space",)),
        (ClosesOnce, ("actions_are_in_the_action_space",)),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_the_checks_find_what_is_wrong(
    cls: type[Expert], failing: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("frobs_tasks_reach.reach.Reach.expert", f"{__name__}:{cls.__name__}")
    report = run_checks(check_policy("expert", REACH))
    assert tuple(result.name for result in report.results if result.status == "failed") == failing
    [check] = [each for each in check_env(REACH) if each.name == "expert_passes_the_checks_of_policies"]
    if cls is Remembers:
        with pytest.raises(AssertionError, match="the first action of a later episode"):
            check.run()


def test_random_actions_pass() -> None:
    statuses = {result.name: result.status for result in run_checks(check_policy("random", REACH)).results}
    assert statuses.pop("episode_start_resets_its_rows") == "not_applicable"
    assert set(statuses.values()) == {"passed"}
