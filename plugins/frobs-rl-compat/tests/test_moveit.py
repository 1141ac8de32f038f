"""The replacement for MoveIt, as packages use it: over the bridge, in processes that 'frobs legacy run' starts."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from frobs_core.util.files import cache_folder

PACKAGE = Path(__file__).with_name("moveit_package")
JOINTS = [f"joint_{i}" for i in range(1, 7)]
POSITIONS = 0.015  # [rad] that gravity bends the arm of the bridge


@pytest.fixture
def results(run_in_workspace: Callable[..., Callable[..., str]]) -> Callable[[str], dict]:
    """Return what runs a script of the package and returns what it told."""

    def run(script: str) -> dict:
        output = run_in_workspace(PACKAGE, "bridge:mujoco", PYTHONPATH=str(PACKAGE / "scripts"))(
            PACKAGE / "scripts" / script
        )
        return json.loads(re.search(r"^RESULT (.*)$", output, re.MULTILINE)[1])

    return run


@pytest.mark.slow
@pytest.mark.ros_feature("commanders of MoveIt", "replacement", "mujoco")
@pytest.mark.ros_feature("dynamic_reconfigure", "replacement")
def test_every_function_of_the_commanders_does_what_moveit_does(results):
    told = results("commander.py")
    assert told["robot"] == [["manipulator", "gripper", "everything"], "map", "world", ["finger_joint"]]
    assert told["group"] == ["manipulator", "tool0", JOINTS, "map"]
    assert told["attribute"] == "manipulator"
    np.testing.assert_allclose(told["home"], 0.0, atol=POSITIONS)
    assert told["state"] == [*JOINTS, "finger_joint"]
    words = ["'arms'", "joint_1", "joint_9", "scaling", "workspace", "compute_cartesian_path", "markers", "Interface"]
    words += ["/elsewhere/robot_description", "start move_group"]
    assert all(word in refusal for word, refusal in zip(words, told["refused"], strict=True))
    assert not told["no target"]

    for done, wanted, reached, _ in told["moves"]:
        assert done
        np.testing.assert_allclose(reached, wanted, atol=POSITIONS)
    assert told["moves"][1][1] == [-0.3, *told["moves"][0][1][1:]]  # the joints that are not named stay

    frame, pose, (roll, pitch, yaw) = told["pose"]
    assert frame == "map"
    cosines, sines = np.cos([roll / 2, pitch / 2, yaw / 2]), np.sin([roll / 2, pitch / 2, yaw / 2])
    w = cosines.prod() + sines.prod()
    assert abs(w) == pytest.approx(abs(pose[6]), abs=0.01)
    for done, reached in told["poses"]:
        assert done
        np.testing.assert_allclose(reached[:3], pose[:3], atol=0.01)
        assert abs(np.dot(reached[3:], pose[3:])) == pytest.approx(1.0, abs=1e-3)
    assert told["position"][0]
    np.testing.assert_allclose(told["position"][1], [0.3, 0.2, 0.5], atol=0.01)
    assert told["in link"][0]
    assert told["in link"][1] == pytest.approx(0.05, abs=0.01)
    assert told["far"] == [False, -31, False]
    assert not told["cleared"]

    lower = np.array([-2.87979, -1.91986, -1.91986, -2.79253, -2.094395, -6.98132])
    upper = np.array([2.87979, 1.91986, 1.22173, 2.79253, 2.094395, 6.98132])
    drawn = np.array(told["random joints"])
    assert ((drawn >= lower) & (drawn <= upper)).all()
    assert (np.ptp(drawn, axis=0) > 0.5 * (upper - lower)).all()
    assert np.ptp(np.array(told["random poses"])[:, :3], axis=0).min() > 0.05

    limits = np.array([2.0, 4.36332, 4.36332, 5.58505, 5.58505, 7.33038])  # joint_limits.yaml and the URDF
    durations = []
    for scaling, plan in told["plans"].items():
        velocity, acceleration = map(float, scaling.split())
        assert plan["success"]
        assert plan["error"] == 1
        assert plan["joints"] == JOINTS
        assert 0.0 < plan["seconds"] < 5.0
        assert (np.array(plan["velocity"]) <= velocity * limits + 1e-9).all()
        assert plan["velocity"][0] > 0.9 * velocity * limits[0] or acceleration < 1.0
        assert plan["acceleration"][0] <= acceleration * 4.0 + 1e-9
        durations.append(plan["duration"])
    assert durations == sorted(durations)

    assert told["execute"] == [True, pytest.approx(0.6, abs=POSITIONS)]
    assert not told["stale"]
    sent, stopped, later = told["stop"]
    assert sent
    assert -1.4 < stopped < 0.6
    assert later == pytest.approx(stopped, abs=0.02)
    assert told["tolerances"] == [[0.002, 0.01, 0.1], [0.05, 0.05, 0.05], 0.05]
    assert told["loose"][0]
    assert np.linalg.norm(np.array(told["loose"][1]) - [0.3, -0.2, 0.5]) < 0.06
    assert told["planning time"] == 0.5

    assert told["gripper"][:2] == [["finger_joint"], True]
    assert told["gripper"][2] == [pytest.approx(0.02, abs=0.002)]
    done, values = told["everything"]
    assert done
    assert values["joint_1"] == pytest.approx(0.2, abs=POSITIONS)
    assert values["finger_joint"] == pytest.approx(0.03, abs=0.002)
    assert told["paused"][0][0] == pytest.approx(0.2, abs=POSITIONS)
    assert told["paused"][1] < 1.0

    assert told["reconfigured"]["allowed_start_tolerance"] == 0.0
    assert told["reconfigured"]["execution_duration_monitoring"] is True
    assert told["any start"]
    assert not told["too slow"]
    assert told["not monitored"]


@pytest.mark.slow
@pytest.mark.ros_feature("planning scene of MoveIt", "replacement", "mujoco")
def test_motions_avoid_what_the_planning_scene_contains(results):
    told = results("scene.py")
    assert told["topic"] == "moveit_msgs/PlanningScene"
    assert told["free"][:2] == [True, 1]
    (found, _, bend), done, names = told["wall"]
    assert found
    assert done
    assert bend > 0.2
    assert names == ["wall"]
    assert told["wall pose"] == 0.45
    assert told["removed"][0][2] == pytest.approx(0.0, abs=1e-6)
    assert told["removed"][1] == []
    in_collision = [False, -12]
    assert told["shapes"] == dict.fromkeys(("box", "sphere", "cylinder", "mesh"), in_collision)
    assert told["none"] == [True, 1]
    assert told["with table"] == [True, 1]
    assert told["stick"] == [in_collision, ["stick"], "tool0"]
    assert told["dropped"] == [["stick", "table"], {}]
    assert told["taken"] == [["table"], ["stick"]]
    assert told["cleared"] == [[], {}, [True, 1]]
    frame, size, ghost, plane = told["refused"]
    assert "rejected" in frame
    assert "above 0" in size
    assert "ghost" in ghost
    assert "add_plane" in plane
    assert told["by topic"] == ["by topic"]


def test_the_stand_in_gives_way_to_moveit(legacy_run, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("import moveit_commander; print(moveit_commander.__file__)")

    def found(**variables: str) -> str:
        command, environment = [*legacy_run, str(script)], {**os.environ, **variables}
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    assert str(cache_folder("ros")) in found()
    (tmp_path / "src" / "moveit_commander").mkdir(parents=True)
    (tmp_path / "src" / "moveit_commander" / "__init__.py").touch()
    assert found(PYTHONPATH=str(tmp_path / "src")) == str(tmp_path / "src" / "moveit_commander" / "__init__.py")
    outside = subprocess.run([sys.executable, "-c", "import moveit_commander"], capture_output=True, text=True)
    assert "No module named 'moveit_commander'" in outside.stderr
