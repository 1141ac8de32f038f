"""A run whose pictures do not fit into memory is refused before its folder exists, with the number that fits."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from frobs_core.util import memory
from frobs_core.util.errors import ConfigurationError
from frobs_train import resolve_config, train

pytestmark = pytest.mark.needs("rendering")
AVAILABLE, SIDE, LENGTH = 100_000_000, 36, 75
PICTURE = 3 * SIDE**2  # [bytes]
EYE = f"eye: {{camera: overview, size: [{SIDE}, {SIDE}]}}"


@pytest.mark.parametrize(
    ("algorithm", "setting", "size", "advice"),
    [
        ("dagger", "steps=1_000_000", PICTURE, "train for at most {} steps"),
        ("bc", "algorithm_config.demonstration_episodes=400", PICTURE * LENGTH, "play at most {} "),
        ("act", "algorithm_config.demonstration_episodes=400", PICTURE * LENGTH, "play at most {} "),
        ("ppo", "algorithm_config.n_steps=7_000", 4 * PICTURE, "set algorithm_config.n_steps to at most {}"),
        ("sac", "algorithm_config.buffer_size=20_000", 2 * PICTURE, "set algorithm_config.buffer_size to at most {}"),
    ],
)
def test_a_run_that_does_not_fit_is_refused_with_the_number_that_fits(
    algorithm: str, setting: str, size: int, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: AVAILABLE)
    flags = {"algorithm": algorithm, "num_envs": 2, "seed": 0}
    terms = (
        f"'*': null, {EYE}" if algorithm in ("ppo", "sac") else EYE
    )  # vectors are kept as well, which changes ``size``
    observed = f"environment_kwargs.observations={{{terms}}}"
    config = resolve_config("frobs/PandaLift-v0", flags=flags, settings=[observed, setting])
    with pytest.raises(ConfigurationError, match=re.escape(advice.format(f"{AVAILABLE // size:,}"))) as caught:
        train(config, tmp_path / "run")
    assert "GB of memory, but 0.1 GB are available" in str(caught.value)
    assert not (tmp_path / "run").exists()
