"""How far a robot is from what it follows, in the second half of each episode."""

from __future__ import annotations

import numpy as np
import pytest

from frobs_train.environments import make_vector_env
from frobs_train.evaluation.playing import EpisodeCounter, error_reader
from frobs_train.logs.recorder import FinishedEpisodes

DYNAMIC = "frobs/Irb120ReachDynamic-v0"


def finish(counter: EpisodeCounter, *env_ids: int) -> None:
    n = len(env_ids)
    counter.add(FinishedEpisodes(np.array(env_ids), np.zeros(n), np.full(n, 4), np.ones(n), {}))


def test_the_first_half_of_an_episode_does_not_count() -> None:
    errors = np.array([9.0, 9.0])
    counter = EpisodeCounter(2, 2, errors=(lambda: errors.copy(), 4))
    for now in ([9.0, 9.0], [9.0, 9.0], [1.0, 3.0]):
        errors[:] = now
        counter.after_step({})
    errors[:] = 9.0  # of the episodes that begin
    finish(counter, 0, 1)
    counter.after_step({})
    assert counter.tracking_error == 2.0


def test_episodes_beyond_those_that_are_wanted_do_not_count() -> None:
    errors = np.array([1.0, 5.0])
    counter = EpisodeCounter(2, 3, errors=(lambda: errors.copy(), 2))  # two of the first environment, one of the second
    counter.after_step({})
    finish(counter, 0, 1)
    counter.after_step({})
    counter.after_step({})
    counter.after_step({})
    assert counter.tracking_error == 1.0


def test_without_errors_there_is_none() -> None:
    counter = EpisodeCounter(1, 1)
    counter.after_step({})
    assert counter.tracking_error is None


@pytest.mark.parametrize(
    ("env_id", "has_one"), [(DYNAMIC, True), ("frobs/Irb120Reach-v0", False), ("CartPole-v1", False)]
)
def test_a_task_that_follows_something_tells_its_error(env_id: str, has_one: bool) -> None:
    env = make_vector_env(env_id, 3, {})
    env.reset(seed=0)
    found = error_reader(env)
    env_limit = env.spec.max_episode_steps if env.spec else None
    if has_one:
        assert found is not None
        assert found[0]().shape == (3,)
        assert (found[0]() > 0.0).all()
        assert found[1] == env_limit == 100
    else:
        assert found is None
    env.close()
