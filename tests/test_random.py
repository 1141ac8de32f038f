import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.random import RandomSource, philox4x32

# Random123's published known answers for philox4x32-10: counter, key, result.
KNOWN_ANSWERS = [
    ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]
WORD = st.integers(0, 0xFFFFFFFF)


def words(text: str) -> list[int]:
    return [int(word, 16) for word in text.split()]


def arrays(numbers: list[int]) -> list[np.ndarray]:
    return [np.array([number], np.uint64) for number in numbers]


def source(*seeds: int) -> RandomSource:
    rng = RandomSource(len(seeds))
    rng.seed(seeds)
    rng.begin_episode()
    return rng


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN_ANSWERS)
def test_philox_gives_the_published_answers(counter, key, answer):
    assert list(philox4x32(words(counter), words(key))) == words(answer)
    assert [int(word[0]) for word in philox4x32(arrays(words(counter)), arrays(words(key)))] == words(answer)


@settings(max_examples=50)
@given(st.lists(WORD, min_size=4, max_size=4), st.lists(WORD, min_size=2, max_size=2))
def test_philox_of_arrays_is_philox_of_numbers(counter, key):
    assert [int(word[0]) for word in philox4x32(arrays(counter), arrays(key))] == list(philox4x32(counter, key))


@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 5), (40,)])
@pytest.mark.parametrize("draw", ["uniform", "normal"])
def test_an_environment_is_the_same_alone_and_among_others(draw, shape):
    num_envs = 33
    together = source(*range(num_envs))
    vector = [getattr(together, draw)("goal", shape=shape) for _ in range(2)]
    for i in range(num_envs):
        alone = source(i)
        for drawn in vector:
            np.testing.assert_array_equal(getattr(alone, draw)("goal", shape=shape)[0], drawn[i], strict=True)


def test_seeds_streams_episodes_steps_and_draws_all_differ():
    rng = source(0, 1)
    seen = [rng.uniform("a"), rng.uniform("a"), rng.uniform("b")]
    rng.clock += 1
    seen += [rng.uniform("a"), rng.uniform("b")]
    rng.begin_episode()
    seen += [rng.uniform("a"), rng.uniform("b")]
    assert len(np.unique(seen)) == 2 * len(seen)


def test_seed_and_stream_of_neighbours_do_not_meet():
    rng = source(*range(1000))
    drawn = np.concatenate([rng.uniform(f"stream {i}") for i in range(20)])
    assert len(np.unique(drawn)) == 20_000


def test_how_often_a_stream_is_drawn_changes_no_other_stream():
    quiet, busy = source(5, 6), source(5, 6)
    for _ in range(7):
        busy.uniform("noise", shape=(3,))
    np.testing.assert_array_equal(quiet.uniform("goal"), busy.uniform("goal"))


def test_how_often_a_stream_is_drawn_does_not_reach_the_next_step():
    quiet, busy = source(5, 6), source(5, 6)
    busy.uniform("goal")
    for rng in (quiet, busy):
        rng.clock += 1
    np.testing.assert_array_equal(quiet.uniform("goal"), busy.uniform("goal"))


def test_a_mask_draws_for_its_environments_only():
    rng, everybody = source(1, 2, 3), source(1, 2, 3)
    mask = np.array([True, False, True])
    first, second = everybody.uniform("goal", shape=(3,)), everybody.uniform("goal", shape=(3,))
    np.testing.assert_array_equal(rng.uniform("goal", shape=(3,), mask=mask), first[mask])
    np.testing.assert_array_equal(rng.uniform("goal", shape=(3,)), np.where(mask[:, None], second, first))


@pytest.mark.parametrize("num_envs", [1, 3, 100])
def test_an_empty_mask_draws_nothing(num_envs):
    rng = source(*range(num_envs))
    nobody = np.zeros(num_envs, bool)
    assert rng.uniform("goal", shape=(3,), mask=nobody).shape == (0, 3)
    assert rng.normal("goal", shape=(2, 3), mask=nobody).shape == (0, 2, 3)
    assert rng.integers("goal", 0, 5, mask=nobody).shape == (0,)
    np.testing.assert_array_equal(rng.uniform("goal"), source(*range(num_envs)).uniform("goal"))


def test_numbers_of_no_size_are_empty():
    assert source(1, 2).uniform("goal", shape=(0,)).shape == (2, 0)


def test_an_episode_of_one_environment_leaves_the_others_alone():
    rng, other = source(1, 2), source(1, 2)
    rng.clock += 1
    other.clock += 1
    rng.uniform("goal")
    other.uniform("goal")
    rng.begin_episode(np.array([True, False]))
    drawn = rng.uniform("goal")
    assert drawn[1] == other.uniform("goal")[1]
    fresh = source(1)
    fresh.begin_episode()
    assert drawn[0] == fresh.uniform("goal")[0]


def test_seeding_one_environment_leaves_the_others_alone():
    rng, other = source(1, 2, 3), source(1, 2, 3)
    mask = np.array([False, True, False])
    for each in (rng, other):
        each.uniform("goal")  # so that a key that was kept would be noticed
        each.begin_episode()
    rng.seed([9], mask)
    rng.begin_episode(mask)
    drawn = rng.uniform("goal")
    assert drawn[1] == source(9).uniform("goal")[0]
    np.testing.assert_array_equal(drawn[[0, 2]], other.uniform("goal")[[0, 2]])


def test_seeding_again_repeats():
    rng = source(1, 2)
    first = rng.uniform("goal")
    for _ in range(3):
        rng.clock += 1
        rng.uniform("goal")
    rng.seed([1, 2])
    rng.begin_episode()
    np.testing.assert_array_equal(rng.uniform("goal"), first)


def test_large_and_negative_seeds_are_kept_apart():
    drawn = source(0, 1, 2**32, 2**53, 2**53 + 1, 2**63, 2**64 - 2, -1).uniform("goal")
    assert len(np.unique(drawn)) == 8
    assert drawn[-1] == source(2**64 - 1).uniform("goal")[0]


def test_seeds_that_are_too_few_are_refused():
    with pytest.raises(ConfigurationError, match="number of seeds is 1; it must be 3"):
        RandomSource(3).seed([1])


def test_a_snapshot_is_continued_bit_for_bit():
    rng = source(1, 2, 3)
    rng.clock += 1
    rng.begin_episode(np.array([True, False, False]))
    rng.uniform("goal")
    snapshot = rng.snapshot()
    other = RandomSource(3)
    other.uniform("goal")
    other.restore(snapshot)
    for each in (rng, other):
        each.clock += 1
    np.testing.assert_array_equal(rng.uniform("goal"), other.uniform("goal"))
    assert not np.shares_memory(snapshot["steps"], other.snapshot()["steps"])


def test_uniform_stays_in_its_bounds_and_fills_them():
    low, high = np.array([-1.0, 0.0, 5.0]), np.array([1.0, 0.1, 9.0])
    drawn = source(*range(20_000)).uniform("goal", low, high, shape=(3,))
    assert drawn.shape == (20_000, 3)
    assert drawn.dtype == np.float64
    assert ((low <= drawn) & (drawn < high)).all()
    scaled = (drawn - low) / (high - low)
    np.testing.assert_allclose(scaled.mean(axis=0), 0.5, atol=0.01)
    np.testing.assert_allclose(scaled.var(axis=0), 1 / 12, atol=0.002)
    np.testing.assert_allclose(np.histogram(scaled, 10, (0, 1))[0], 6_000, atol=400)
    np.testing.assert_allclose(np.corrcoef(scaled.T), np.eye(3), atol=0.03)


def test_neighbouring_steps_and_environments_are_uncorrelated():
    rng = source(*range(10_000))
    before = rng.uniform("noise")
    rng.clock += 1
    after = rng.uniform("noise")
    assert abs(np.corrcoef(before, after)[0, 1]) < 0.04
    assert abs(np.corrcoef(before[:-1], before[1:])[0, 1]) < 0.04


def test_normal_has_its_mean_and_spread():
    drawn = source(*range(20_000)).normal("noise", mean=2.0, std=3.0)
    assert np.isfinite(drawn).all()
    assert drawn.mean() == pytest.approx(2.0, abs=0.1)
    assert drawn.std() == pytest.approx(3.0, abs=0.1)
    assert (abs(drawn - 2.0) > 6.0).mean() == pytest.approx(0.0455, abs=0.006)  # beyond two standard deviations


def test_integers_reach_all_of_their_numbers_and_no_other():
    drawn = source(*range(5_000)).integers("cell", -2, 3)
    assert drawn.dtype == np.int64
    values, counts = np.unique(drawn, return_counts=True)
    assert values.tolist() == [-2, -1, 0, 1, 2]
    np.testing.assert_allclose(counts, 1_000, atol=150)


def test_integers_of_an_empty_range_are_refused():
    with pytest.raises(ConfigurationError, match=r"stream 'cell': the interval \[3, 3\) does not contain an integer"):
        source(1).integers("cell", 3, 3)


def test_episodes_and_steps_are_told():
    source = RandomSource(2)
    source.seed([1, 2])
    source.begin_episode()
    source.clock += 1
    source.begin_episode(np.array([True, False]))
    source.clock += 1
    assert source.episodes.tolist() == [1, 0]
    assert source.steps.tolist() == [1, 2]
