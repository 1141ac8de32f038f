from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from frobs_core.util.errors import ConfigFileError, ConfigurationError
from frobs_tasks_navigation.floor_plan import BUILT_IN, read_floor_plan

FLAT = """
walls:
  thickness: 0.1
  height: 2.0
  pieces:
    - {from: [0, 0], to: [4, 3]}
    - {centre: [2, 5], length: 6, along: x, thickness: 0.2}
    - {centre: [2, 5], length: 6, along: 45}
start: {pos: [1, 2], yaw: 90}
goals: {low: [2, 3], high: [3, 4]}
"""


@pytest.fixture
def flat(tmp_path: Path) -> Path:
    path = tmp_path / "flat.yaml"
    path.write_text(FLAT, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_built_in_plans_can_be_read(name):
    read_floor_plan(name)


def test_the_maze_is_frobs_rls():
    maze = read_floor_plan("maze")
    assert len(maze.walls.pieces) == 17
    assert sum(wall.middle[1] for wall in maze.walls.pieces) == pytest.approx(138.0)
    assert [len(route) for route in maze.routes] == [7, 7, 7, 7]
    assert len({route[:2] for route in maze.routes}) == 1
    assert len(maze.boxes) == 2
    assert maze.start.pos == (-5.0, 7.5)


def test_no_way_point_of_the_maze_is_in_a_wall():
    maze = read_floor_plan("maze")
    for route in maze.routes:
        for x, y in route:
            for wall in maze.walls.pieces:
                (cx, cy), length, angle = wall.middle
                along = (x - cx) * math.cos(angle) + (y - cy) * math.sin(angle)
                across = abs((y - cy) * math.cos(angle) - (x - cx) * math.sin(angle))
                assert across > 0.3 or abs(along) > length / 2 + 0.3, ((x, y), wall)


def test_a_wall_is_two_ends_or_a_centre(flat):
    first, second, third = read_floor_plan(flat).walls.pieces
    assert first.middle == ((2.0, 1.5), 5.0, pytest.approx(math.atan2(3, 4)))
    assert second.middle == ((2.0, 5.0), 6.0, 0.0)
    assert third.middle[2] == pytest.approx(math.pi / 4)
    assert (first.thickness, second.thickness) == (None, 0.2)


def test_the_area_is_around_everything_where_it_is_not_given(flat):
    plan = read_floor_plan(flat)
    low, high = plan.bounds
    assert low == pytest.approx([-1 - 10, -10])
    assert high == pytest.approx([5 + 10, 5 + 3 * math.sqrt(0.5) + 10])
    assert np.all(plan.extent[0] > low)


@pytest.mark.parametrize(
    ("change", "line", "message"),
    [
        (("length: 6, along: x", "lenght: 6, along: x"), 7, "'lenght'.*Did you mean 'length'"),
        (("goals:", "gaols:"), 10, "'gaols'.*Did you mean 'goals'"),
        (("thickness: 0.1", "thickness: -0.1"), 3, "thickness is -0.1.*greater than 0"),
        (("from: [0, 0], to", "from: [0, .nan], to"), 6, "finite"),
        (("{from: [0, 0], to: [4, 3]}", "{from: [0, 0], length: 3}"), None, "either 'from' and 'to', or 'centre'"),
        (("low: [2, 3]", "low: [5, 3]"), None, "must not exceed"),
        (("pos: [1, 2]", "low: [1, 2]"), None, "either 'pos', or 'low' and 'high'"),
        (("goals: {low: [2, 3], high: [3, 4]}", "routes: []"), None, "either 'routes' or 'goals'"),
        (("goals: {low: [2, 3], high: [3, 4]}", "routes: [[]]"), None, "routes"),
        (("start: {pos", "area: {low: [0, 0], high: [9, 9]}\nstart: {pos"), None, None),
        (("start: {pos", "area: {low: [5, 5], high: [9, 9]}\nstart: {pos"), None, "outside the area"),
    ],
    ids=[
        "unknown key",
        "unknown key at the top",
        "negative",
        "not finite",
        "half a wall",
        "corners changed about",
        "half a start",
        "no way",
        "empty route",
        "an area",
        "start outside",
    ],
)
def test_mistakes_are_told_with_file_and_line(flat, change, line, message):
    text = flat.read_text(encoding="utf-8")
    assert change[0] in text
    flat.write_text(text.replace(*change), encoding="utf-8")
    if message is None:
        read_floor_plan(flat)
        return
    with pytest.raises(ConfigFileError, match=message) as failure:
        read_floor_plan(flat)
    assert failure.value.path == flat
    if line is not None:
        assert failure.value.line == line


def test_a_plan_that_is_not_there_names_those_that_are(tmp_path):
    with pytest.raises(ConfigFileError, match="'maze', 'empty', 'dynamic'"):
        read_floor_plan("mase")
    with pytest.raises(ConfigFileError, match="the file does not exist"):
        read_floor_plan(tmp_path / "flat.yaml")


def test_a_plan_may_be_a_mapping():
    plan = read_floor_plan({"start": {"pos": (0, 0)}, "routes": [[(1, 0)]]})
    assert plan.routes == (((1.0, 0.0),),)
    with pytest.raises(ConfigurationError, match="the floor plan"):
        read_floor_plan({"start": {"pos": (0, 0)}, "routes": [[(1, 0)]], "wals": {}})
