"""All robots of two packages: what is built is what the file says, or a note tells of it, or the file is refused."""

from __future__ import annotations

import pytest

pytest.importorskip("pinocchio", exc_type=ImportError)  # which needs libgomp1
pytest.importorskip("pybullet_data")

from compare import TOLERANCE, compare
from corpus import FAST, REFUSED, UNDRAWN, files

from frobs_core import plugins
from frobs_core.models import load_model

FILES = files()
SIMULATORS = sorted({*plugins.engines()} - {"gazebo"})  # which takes seconds to start


def check(name: str, simulator: str) -> None:
    if name in UNDRAWN:
        with pytest.warns(UserWarning, match="a visual is not drawn, because .* does not exist"):
            model = load_model(FILES[name])
        assert "missing-visual" in {note.rule for note in model.notes}
        return
    result = compare(FILES[name], simulator)
    if name in REFUSED:
        assert REFUSED[name] in result.refused
        return
    assert not result.refused
    assert not result.untold
    assert result.kinematics <= TOLERANCE, result.kinematics_note


@pytest.mark.parametrize("simulator", SIMULATORS)
@pytest.mark.parametrize("name", FAST)
def test_a_robot_is_built_as_its_file_says(name, simulator):
    check(name, simulator)


@pytest.mark.slow
@pytest.mark.parametrize("simulator", SIMULATORS)
@pytest.mark.parametrize("name", sorted(FILES.keys() - set(FAST)))
def test_every_robot_is_built_as_its_file_says(name, simulator):
    check(name, simulator)


def test_at_least_forty_robots_are_examined():
    assert len(FILES.keys() - REFUSED.keys()) >= 40
