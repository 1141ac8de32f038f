from __future__ import annotations

from itertools import pairwise

from frobs_train.training.seeds import spread_seed


def test_the_same_seed_spreads_the_same_way() -> None:
    assert spread_seed(3) == spread_seed(3)


def test_neighbouring_seeds_share_no_environment() -> None:
    starts = sorted(spread_seed(seed).environment for seed in range(100))
    assert min(later - earlier for earlier, later in pairwise(starts)) > 4096


def test_evaluation_never_meets_a_training_seed() -> None:
    for seed in range(1000):
        seeds = spread_seed(seed)
        assert 0 <= seeds.environment < 2**30 - 2**20
        assert 2**30 <= seeds.evaluation < 2**31 - 2**20
        assert 0 <= seeds.algorithm < 2**31
