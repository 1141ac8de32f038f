from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from frobs_core import plugins
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigFileError
from frobs_train.configuration import other_layouts


def read(mapping: Mapping[str, Any], algorithm: str, path: Path) -> tuple[dict[str, Any], str]:
    """Translate the layout of a plugin."""
    return {"algorithm": algorithm, "steps": mapping["mine"]["steps"]}, ""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "settings.yaml"
    path.write_text("mine: {steps: 7}\n")
    return path


def test_a_layout_in_the_record_of_an_algorithm_is_deprecated(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = replace(
        cast("AlgorithmRecord", plugins.get_record("algorithm", "ppo")), config_files={"mine.steps": f"{__name__}:read"}
    )
    monkeypatch.setitem(sys.modules, __name__, SimpleNamespace(read=read))
    monkeypatch.setattr(plugins, "records", lambda cls: {"ppo": record} if cls is AlgorithmRecord else {})
    with pytest.warns(FrobsDeprecationWarning, match=r"config_files of the algorithm 'ppo'.*ConfigLayoutRecord"):
        settings, translated = other_layouts.read_config_file(file)
    assert (settings["algorithm"], settings["steps"], translated) == ("ppo", 7, True)


def test_a_file_of_no_known_layout_is_not_translated(file: Path) -> None:
    assert other_layouts.read_config_file(file) == ({"mine": {"steps": 7}}, False)


def test_a_file_of_frobs_rl_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(other_layouts, "_layouts", lambda: iter(()))  # as without frobs-rl-compat
    path = tmp_path / "td3.yaml"
    path.write_text("model_params: {td3_params: {}}\n")
    with pytest.raises(ConfigFileError, match=r"layout of FRobs_RL; to read it: pip install .*frobs-rl-compat"):
        other_layouts.read_config_file(path)
