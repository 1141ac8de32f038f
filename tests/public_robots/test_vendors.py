"""Models of public repositories end in a verdict, and MJCF robots move as in bare MuJoCo."""

from __future__ import annotations

import json
import os
from pathlib import Path

import gymnasium
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("pybullet")

from bare_mujoco import beside_mujoco
from vendors import FOUND, LIST, examine, models

GYMNASIUM = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
FOLDER = os.environ.get("FROBS_VENDOR_MODELS", "")


def test_at_least_sixty_models_were_examined_and_none_caused_a_traceback():
    found = json.loads(FOUND.read_text("utf-8"))
    assert found.keys() == {name for name, _, _ in models(Path())}, f"{FOUND.name} and {LIST.name} differ"
    assert len(found) >= 60
    assert not [name for name, what in found.items() if what["unforeseen"]]
    assert all(what["rejected"] for what in found.values() if what["verdict"] == "rejected")


def test_mjcf_models_of_public_repositories_moved_as_in_bare_mujoco():
    found = json.loads(FOUND.read_text("utf-8"))
    beside = {name: what["beside"] for name, what in found.items() if what["beside"]}
    assert len(beside) >= 20
    assert max(what["bodies"] for what in beside.values()) < 1e-12
    assert max(what["joints"] for what in beside.values()) < 1e-12
    assert max(what["motion"] for what in beside.values()) < 1e-4


@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass' is deprecated")
@pytest.mark.parametrize("file", sorted(GYMNASIUM.glob("*.xml")), ids=lambda file: file.stem)
def test_robots_of_gymnasium_are_built_and_move_as_in_bare_mujoco(file):
    beside = beside_mujoco(file)
    assert beside.bodies < 1e-12
    assert beside.joints < 1e-12
    assert beside.motion < 1e-9


@pytest.mark.slow
@pytest.mark.needs("vendors")
@pytest.mark.parametrize("item", list(models(Path(FOLDER))), ids=lambda item: item[0])
def test_a_model_of_a_public_repository_ends_as_the_survey_says(item):
    name, what = examine(item)
    expected = json.loads(FOUND.read_text("utf-8"))[name]
    assert not what["unforeseen"]
    assert what["verdict"] == expected["verdict"]
