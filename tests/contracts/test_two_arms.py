"""Two different arms in one environment learn to reach at the same time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from frobs_train import evaluate, resolve_config, train

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "grippers.md"


@pytest.mark.slow
def test_both_arms_reach_with_the_settings_of_the_documentation(tmp_path):
    settings = re.search(r'```yaml file="two_arms.yaml"\n(.*?)```', PAGE.read_text(encoding="utf-8"), re.DOTALL)
    file = tmp_path / "two_arms.yaml"
    file.write_text(settings[1], encoding="utf-8")
    config = resolve_config(file=file, settings=["environment=frobs/Env-v0", "seed=0"])
    run = train(config, tmp_path / "run")
    assert evaluate(run, episodes=200).success_rate >= 0.95  # of both arms at the same time
