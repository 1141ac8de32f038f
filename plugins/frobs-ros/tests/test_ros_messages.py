"""The message packages: current, and the ones that others speak."""

from __future__ import annotations

import filecmp
import os
import re
import runpy
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from frobs_ros.messages import FOLDER, PACKAGES

TOOL = Path(__file__).resolve().parents[1] / "tools" / "generate_messages.py"

# From public releases of gazebo_ros 2.9 and ros_control 0.20, and of control_msgs 1.5.
CHECKSUMS = {
    "gazebo_msgs/ModelState": "9330fd35f2fcd82d457e54bd54e10593",
    "gazebo_msgs/SpawnModel": "9ed9c82c96abe1a00c3e8cdaeee24413",
    "gazebo_msgs/DeleteModel": "9ce56b4e9e54616de25d796dc972a262",
    "gazebo_msgs/GetModelState": "4c515e936d3319c9610c559c60bfc3d4",
    "gazebo_msgs/SetModelState": "5b3ab0281d4f5445def017e3a2e4a07b",
    "gazebo_msgs/GetPhysicsProperties": "575a5e74786981b7df2e3afc567693a6",
    "gazebo_msgs/SetPhysicsProperties": "97e2057080558ce4730434b5fae75c91",
    "gazebo_msgs/GetWorldProperties": "36bb0f2eccf4d8be971410c22818ba3f",
    "gazebo_msgs/GetModelProperties": "5717f7bd34ed990fa80e28b3015027a3",
    "gazebo_msgs/GetJointProperties": "7b30be900f50aa21efec4a0ec92d91c9",
    "gazebo_msgs/SetModelConfiguration": "10e3139d3b669c40afc057d38956fff7",
    "gazebo_msgs/ApplyJointEffort": "c0039811b8cc919490b3cff748cdf46b",
    "gazebo_msgs/ApplyBodyWrench": "585b9f9618aa0581b207e2f2d90866bc",
    "gazebo_msgs/JointRequest": "0be1351618e1dc030eb7959d9a4902de",
    "gazebo_msgs/BodyRequest": "5eade9afe7f232d78005bd0cafeab755",
    "gazebo_msgs/GetLinkState": "09d6c98cce97b35f7ab9bd70300657ab",
    "gazebo_msgs/SetLinkState": "8a5146eb66ae4d26b0860b08f3f271be",
    "gazebo_msgs/GetLinkProperties": "0e06a70386d0ee3fb880c02f23fcd821",
    "gazebo_msgs/SetLinkProperties": "d534ce1b36ee99de0ffa806c3a6348f0",
    "gazebo_msgs/SetJointProperties": "15a76e921b1410c698d82782ea5fa370",
    "controller_manager_msgs/LoadController": "647e5c54b8d6468952d8d31f1efe96c0",
    "controller_manager_msgs/UnloadController": "647e5c54b8d6468952d8d31f1efe96c0",
    "controller_manager_msgs/SwitchController": "b29a7abc673b2c54c14b54e50f8d06a5",
    "controller_manager_msgs/ListControllers": "1341feb2e63fa791f855565d0da950d8",
    "controller_manager_msgs/ListControllerTypes": "c1d4cd11aefa9f97ba4aeb5b33987f4e",
    "controller_manager_msgs/ReloadControllerLibraries": "40e8c411fd1797d2e2c486018f846040",
    "control_msgs/FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
    "control_msgs/JointTrajectoryControllerState": "10817c60c2486ef6b33e97dcd87f4474",
    "control_msgs/JointControllerState": "987ad85e4756f3aef7f1e5e7fe0595d1",
    "control_msgs/JointTolerance": "f544fe9c16cf04547e135dd6063ff5be",
    "control_msgs/GripperCommandAction": "950b2a6ebe831f5d4f4ceaba3d8be01e",
}


@pytest.mark.parametrize(("name", "checksum"), CHECKSUMS.items(), ids=CHECKSUMS)
def test_message_has_the_public_checksum(name: str, checksum: str) -> None:
    package, kind = name.split("/")
    folder = "msg" if (FOLDER / package / "msg" / f"_{kind}.py").exists() else "srv"
    # Of a service: the class of its name comes last in the file, after request and response.
    found = re.findall(r"^  _md5sum = ['\"](\w+)['\"]", (FOLDER / package / folder / f"_{kind}.py").read_text(), re.M)
    assert found[-1] == checksum


def test_generated_messages_are_current(tmp_path: Path, ros: None) -> None:
    tool = runpy.run_path(str(TOOL))
    tool["main"](tmp_path)
    made = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.py"))
    kept = sorted(str(path.relative_to(FOLDER)) for path in FOLDER.rglob("*.py"))
    assert made == kept
    same, differ, errors = filecmp.cmpfiles(tmp_path, FOLDER, made, shallow=False)
    assert (differ, errors) == ([], [])
    assert len(same) > 80


def test_packages_are_all_there_are() -> None:
    assert sorted(path.name for path in FOLDER.iterdir() if path.name != "__pycache__") == list(PACKAGES)


def test_importing_the_package_imports_no_ros() -> None:
    code = "import sys, frobs_ros.messages; sys.exit(any(m in sys.modules for m in ('rospy', 'genpy')))"
    assert subprocess.run([sys.executable, "-c", code], env=dict(os.environ), check=False).returncode == 0


def test_every_package_can_be_imported_beside_ros(ros: None) -> None:
    for package in PACKAGES:
        assert import_module(package).__file__ is not None
    from control_msgs.msg import FollowJointTrajectoryAction
    from gazebo_msgs.srv import SpawnModel

    assert SpawnModel._request_class().model_xml == ""
    assert FollowJointTrajectoryAction().action_goal.goal.trajectory.points == []
