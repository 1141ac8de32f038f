"""The message packages: the types that other nodes use, and the cache that stores their Python code."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

from frobs_ros.errors import RosNotFoundError
from frobs_ros.messages import PACKAGES, cache, message_folder

# From public releases of gazebo_ros 2.9 and ros_control 0.20, of control_msgs 1.5, and of MoveIt 1.1 for Noetic.
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
    "moveit_msgs/AttachedCollisionObject": "30199ef516f64c8bc1edb1084ce4584e",
    "moveit_msgs/CollisionObject": "dbba710596087da521c07564160dfccb",
    "moveit_msgs/MoveItErrorCodes": "35a153d4489afb90a182bbf874ecc0f3",
    "moveit_msgs/PlanningScene": "acfc50bcfd6c7b978066bfa7c786002c",
    "moveit_msgs/PlanningSceneComponents": "bc993e784476960b918b6e7ad5bb58ce",
    "moveit_msgs/RobotTrajectory": "dfa9556423d709a3729bcef664bddf67",
    "shape_msgs/Mesh": "1ffdae9486cd3316a121c578b47a85cc",
    "shape_msgs/SolidPrimitive": "d8f8cbc74c5ff283fca29569ccefb45d",
    "dynamic_reconfigure/Reconfigure": "bb125d226a21982a4a98760418dc2672",
}


GENERATE = "from frobs_ros.messages import message_folder; print(message_folder())"
DAMAGES = {
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:1000]),
    "empty": lambda path: path.write_bytes(b""),
    "missing": Path.unlink,
}


@pytest.fixture
def own_cache(ros: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache; the folder that contains one folder for each key."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "frobs" / "messages"


def contents(folder: Path) -> dict[str, bytes]:
    found = [path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def start(code: str, **variables: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", code]
    environment = {**os.environ, **variables}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize(("name", "checksum"), CHECKSUMS.items(), ids=CHECKSUMS)
@pytest.mark.ros_feature("messages of packages that Debian does not have", "replacement")
def test_message_has_the_published_checksum(name: str, checksum: str, ros: None) -> None:
    package, short = name.split("/")
    (file,) = message_folder().glob(f"{package}/*/_{short}.py")
    # The class of a service is the last one in its file, after its request and response.
    assert re.findall(r"^  _md5sum = ['\"](\w+)['\"]", file.read_text(), re.M)[-1] == checksum


def test_every_definition_becomes_a_module(ros: None) -> None:
    definitions = [path.relative_to(cache.DEFINITIONS) for path in cache.DEFINITIONS.rglob("*.*")]
    folder = message_folder()
    assert sorted(path.name for path in folder.iterdir() if path.is_dir()) == list(PACKAGES)
    assert len(definitions) > 50
    for path in definitions:
        package, kind, file = path.parts
        module = f"{package}/msg/_{path.stem}Action.py" if kind == "action" else f"{package}/{kind}/_{path.stem}.py"
        assert (folder / module).is_file(), file


def test_importing_the_package_imports_no_ros() -> None:
    code = "import sys, frobs_ros.messages; sys.exit(any(m in sys.modules for m in ('rospy', 'genpy', 'genmsg')))"
    assert subprocess.run([sys.executable, "-c", code], env=dict(os.environ), check=False).returncode == 0


def test_every_package_can_be_imported_beside_ros(ros: None) -> None:
    for package in PACKAGES:
        assert import_module(package).__file__ is not None
    from control_msgs.msg import FollowJointTrajectoryAction
    from gazebo_msgs.srv import SpawnModel

    assert SpawnModel._request_class().model_xml == ""
    assert FollowJointTrajectoryAction().action_goal.goal.trajectory.points == []


def test_a_full_cache_is_used_without_generating_and_quickly(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = contents(message_folder())
    monkeypatch.setattr(cache, "generate", lambda _: pytest.fail("generated again"))
    durations = []
    for _ in range(5):
        begin = time.process_time()
        folder = message_folder()
        durations.append(time.process_time() - begin)
    assert min(durations) < 0.02  # [s]
    assert contents(folder) == before


def test_another_definition_is_another_folder(own_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = message_folder()
    changed = tmp_path / "messages" / "definitions"
    shutil.copytree(cache.DEFINITIONS, changed)
    with (changed / "frobs_msgs" / "srv" / "StepWorld.srv").open("a") as file:
        file.write("uint8 another_field\n")
    monkeypatch.setattr(cache, "DEFINITIONS", changed)
    second = message_folder()
    assert sorted(own_cache.iterdir()) == sorted([first, second])
    assert "another_field" in (second / "frobs_msgs" / "srv" / "_StepWorld.py").read_text()
    assert "another_field" not in (first / "frobs_msgs" / "srv" / "_StepWorld.py").read_text()


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
@pytest.mark.parametrize("name", ["gazebo_msgs/msg/_ModelState.py", "control_msgs/msg/__init__.py", "sha256"])
def test_a_damaged_cache_is_repaired(name: str, damage: object, own_cache: Path) -> None:
    whole = contents(message_folder())
    (file,) = own_cache.glob(f"*/{name}")
    damage(file)  # type: ignore[operator]
    assert contents(message_folder()) == whole


def test_a_file_that_was_not_generated_is_removed(own_cache: Path) -> None:
    folder = message_folder()
    whole = contents(folder)
    (folder / "gazebo_msgs" / "msg" / "_Foreign.py").write_text("raise SystemExit")
    assert contents(message_folder()) == whole


@pytest.mark.slow
def test_several_processes_may_fill_the_cache_at_once(own_cache: Path) -> None:
    code = f"{GENERATE}; from frobs_ros.ros.environment import use_ros; use_ros(); import gazebo_msgs.srv, control_msgs.msg"
    running = [start(code, PYTHONHASHSEED=str(seed)) for seed in range(3)]
    outputs = [process.communicate(timeout=60.0) for process in running]
    assert [process.returncode for process in running] == [0, 0, 0], outputs
    (folder,) = own_cache.iterdir()
    assert [out.strip() for out, _ in outputs] == [str(folder)] * 3
    assert not list(own_cache.rglob("*.part"))
    together = contents(folder)
    shutil.rmtree(folder)
    assert contents(message_folder()) == together


@pytest.mark.parametrize("home", ["/proc/1/no-such-folder", "/dev/null"])  # root cannot write there either
def test_without_a_writable_home_the_error_says_what_to_set(home: str, ros: None) -> None:
    process = start(GENERATE, XDG_CACHE_HOME="", HOME=home)
    _, err = process.communicate(timeout=60.0)
    assert process.returncode == 1
    assert "set XDG_CACHE_HOME to a writable folder" in err.splitlines()[-1]


def test_a_read_only_cache_that_is_full_needs_no_writing(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = message_folder()
    monkeypatch.setattr(cache, "write_aside", lambda *_: pytest.fail("written"))
    assert message_folder() == folder


@pytest.mark.parametrize("module", ["genpy", "genmsg"])
def test_without_the_generator_the_error_names_its_debian_package(
    module: str, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = cache.find_spec
    monkeypatch.setattr(cache, "find_spec", lambda name: None if name == module else found(name))
    with pytest.raises(
        RosNotFoundError, match=rf"module '{module}' is not installed.*apt-get install python3-{module}'"
    ):
        message_folder()


def test_without_a_message_package_the_error_names_its_debian_package(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from frobs_ros.messages import generator

    found = generator.find_spec
    monkeypatch.setattr(generator, "find_spec", lambda name: None if name == "actionlib_msgs" else found(name))
    with pytest.raises(
        RosNotFoundError, match=r"module 'actionlib_msgs' is not installed.*apt-get install python3-actionlib-msgs'"
    ):
        message_folder()
