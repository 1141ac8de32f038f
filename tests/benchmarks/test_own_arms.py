"""The benchmark of arms from their files: its page, its search for files, and its arms, with few episodes."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

pytest.importorskip("frobs_train")

import own_arms
from gripper_arms import arm, robot, two_fingers

from frobs_core.description import Robot
from frobs_core.models import find_reader
from frobs_devkit.testing import check_robot, run_checks

ROW: dict[str, Any] = {
    "name": "arm",
    "maker": "Maker",
    "simulator": "mujoco",
    "commit": "abc",
    "episodes": 100,
    "axes": 4,
    "drives": 2,
    "one_jaw": False,
    "gap_mm": [0.4, 60.0],
    "derive_cpu_s": 31.0,
    "object_mm": 30.0,
    "area_m": 0.12,
    "tolerance_mm": 20.0,
    "radial": True,
    "steps": 200,
    "reach": 0.5,
    "expert": 0.97,
}


def test_the_page_is_what_the_stored_results_render_to() -> None:
    assert own_arms.PAGE.read_text("utf-8") == own_arms.report(own_arms.kept_rows())


def test_the_page_marks_missed_goals_and_lists_refused_files() -> None:
    refused = {**dict.fromkeys(("name", "maker", "commit"), "b"), "simulator": "pybullet", "refused": "no | fingers"}
    page = own_arms.report([ROW, refused])
    assert "| arm | Maker | 4 (free yaw) | 2 drives | 0–60 mm | 30 mm | 0.12 m | 20 mm | 200 | 31 s (missed) |" in page
    assert "| 50% | 97.0% (missed) | 100 |" in page
    assert "## Refused files" in page
    assert "| b on pybullet | no / fingers |" in page


def test_model_files_are_found_in_folders(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "arm.urdf").write_text(robot(arm(), two_fingers()))
    (tmp_path / "arm.xml").write_text("<launch/>")
    (tmp_path / "arm.xacro").write_text('<robot><xacro:property name="x" value="1"/></robot>')
    (found,) = own_arms.named_arms([tmp_path], {"dof": "6"}, {})
    assert (found.name, found.xacro_args) == ("inner/arm.urdf", {"dof": "6"})


def test_an_arm_without_a_gripper_is_stored_with_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "bare.urdf"
    file.write_text(robot(arm()))
    found = own_arms.measure(own_arms.Arm("bare", file), 1, "mujoco", trains=False, kept=tmp_path)
    assert "closes on no other part" in found["refused"] or "move no finger" in found["refused"]
    assert own_arms.kept_rows(tmp_path) == [found]


ARMS = {each.name: each for each in own_arms.package_arms()}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*a visual is not drawn")
@pytest.mark.parametrize("name", [*own_arms.LIST["packages"], *own_arms.LIST["refused"]])
def test_the_expert_controls_the_arms_of_packages(name: str, tmp_path: Path) -> None:
    if name not in ARMS:
        pytest.skip("needs example-robot-data and pybullet_data")
    found = own_arms.measure(ARMS[name], 20, "mujoco", trains=False, kept=tmp_path)
    assert not own_arms.unforeseen(found), found
    if name in own_arms.UNSERVED:
        assert own_arms.UNSERVED[name] in found["failed"]
    elif name in own_arms.LIST["packages"]:
        assert found["expert"] >= 0.9


ERD, IGNORED = "example-robot-data/", r"'D' of 7 .*'K' of 7 .*'mu_coulomb' of 7 .*'mu_viscous' of 7 .* To fix: correct"
COMPLAINTS: dict[str, dict[str, str]] = {
    ERD + "panda_description/urdf/panda.urdf": {
        "notes_are_none": IGNORED,  # URDF does not define these attributes of <dynamics>
    },
    ERD + "panda_description/urdf/panda_collision.urdf": {
        "notes_are_none": IGNORED,  # the same
    },
    ERD + "so_arm_description/urdf/so100.urdf": {
        "masses_fit_shapes": "'jaw'.* longest along y, but .* longest along z",  # two of its moments are exchanged
    },
    ERD + "b1_description/urdf/b1-z1.urdf": {
        "home_is_above_floor": "'FR_foot' at -0.38 m;.*'pos': .0, 0, 0.38",  # the arm stands on a robot with legs
    },
    ERD + "z1_description/urdf/z1.urdf": {
        "moving_links_touch": "'link01'.*'link05'",  # the file has no collision shapes for these two
    },
    "pybullet_data/franka_panda/panda.urdf": {
        "inertias_fit_sizes": "'panda_link7' has a moment of inertia of 0.1",  # all links have 0.1 kg·m²
    },
}
"""True complaints of the conformance kit about the files of packages: a part of each message, by check."""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*a visual is not drawn")
@pytest.mark.parametrize("name", own_arms.LIST["packages"])
def test_the_kit_complains_only_about_faults_of_the_file(name: str) -> None:
    if name not in ARMS:
        pytest.skip("needs example-robot-data and pybullet_data")
    file = ARMS[name].file
    described = find_reader(file).with_gripper(Robot(model=str(file), name="arm"))
    report = run_checks(check_robot(described, ["mujoco", "pybullet"]))
    assert report.inconclusive == ()
    expected = COMPLAINTS.get(name, {})
    assert [each.name for each in report.failed] == [*expected], report.failed
    for each in report.failed:
        assert re.search(expected[each.name], each.message), each.message


@pytest.mark.slow
def test_a_policy_is_trained_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(robot(arm(), two_fingers()))
    sets = ("algorithm_config.net_arch=[64]", "algorithm_config.updates=50", "algorithm_config.final_updates=100")
    found = own_arms.train(
        file, 8, "mujoco", tmp_path / "run", "--steps", "2000", *(w for s in sets for w in ("--set", s))
    )
    assert 0.0 <= found["trained"] <= 1.0
