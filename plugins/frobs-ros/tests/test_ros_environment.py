from __future__ import annotations

import subprocess
import sys
from importlib.machinery import PathFinder
from pathlib import Path

import pytest

from frobs_core.errors import ConfigurationError
from frobs_ros import environment, finder
from frobs_ros.environment import child_variables, find_ros, set_variables
from frobs_ros.errors import RosNotFoundError
from frobs_ros.link import link_modules, site_packages, unlink_modules


def folder_of_debian(tmp_path: Path) -> Path:
    """A folder like Debian's: modules of ROS among others."""
    for file in ("rospy/__init__.py", "my_msgs/msg/__init__.py", "numpy/__init__.py", "rospkg/__init__.py", "yaml.py"):
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    return tmp_path


def test_only_modules_of_ros_are_found_in_the_systems_folder(tmp_path: Path) -> None:
    found = finder.RosFinder([folder_of_debian(tmp_path)])
    assert all(found.find_spec(name) is not None for name in ("rospy", "my_msgs", "rospkg"))
    assert all(found.find_spec(name) is None for name in ("numpy", "yaml", "rospy.core", "roslib"))
    assert finder.modules_of_ros(tmp_path) == ["my_msgs", "rospy"]


def test_the_environments_own_numpy_stays_in_front(ros: None) -> None:
    code = (
        "from frobs_ros.environment import use_ros; use_ros(); import numpy, yaml; print(numpy.__file__, yaml.__file__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "/usr/lib/python3" not in done.stdout


def test_nothing_of_ros_is_imported_until_it_is_used() -> None:
    modules = (
        "frobs_ros.ros_gazebo frobs_ros.ros_controllers frobs_ros.ros_launch frobs_ros.ros_node frobs_ros.ros_params"
    )
    modules += (
        " frobs_ros.ros_spawn frobs_ros.ros_urdf frobs_ros.robot_basic_env frobs_ros.cli.ros frobs_ros.cli.doctor_ros"
    )
    code = f"import sys, {modules.replace(' ', ', ')}; print([m for m in ('rospy', 'rosgraph', 'mujoco') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_machine_without_ros_is_told_what_to_install(tmp_path: Path) -> None:
    code = f"""
from pathlib import Path
from frobs_ros import environment
environment.DISTRIBUTION = environment.SYSTEM = Path({str(tmp_path)!r})
from frobs_ros.ros_gazebo import gazebo_pause_physics
gazebo_pause_physics()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    if PathFinder.find_spec("rospy") is None:
        assert "RosNotFoundError: ROS cannot be used: no module 'rospy'" in done.stderr
        assert "apt-get install ros-core" in done.stderr
        assert "frobs doctor ros" in done.stderr


def test_nodes_are_kept_on_this_machine_unless_somebody_asks_otherwise() -> None:
    here: dict[str, str] = {}
    set_variables(here)
    assert here == {"ROS_MASTER_URI": "http://localhost:11311", "ROS_HOSTNAME": "localhost"}
    for asked in ({"ROS_IP": "10.0.0.3"}, {"ROS_MASTER_URI": "http://robot:11311"}):
        variables = dict(asked)
        set_variables(variables)
        assert "ROS_HOSTNAME" not in variables
        assert asked.items() <= variables.items()


def test_programs_of_ros_get_the_systems_python_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/home/me/.pyenv/shims:/usr/bin:/opt/tool")
    monkeypatch.setenv("VIRTUAL_ENV", "/home/me/venv")
    variables = child_variables()
    assert variables["PATH"].endswith("/usr/bin:/bin:/home/me/.pyenv/shims:/opt/tool")
    assert "VIRTUAL_ENV" not in variables


@pytest.fixture
def venv(tmp_path: Path) -> Path:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    return tmp_path / "venv"


def test_links_make_rospy_importable_in_a_virtual_environment_and_nothing_else(ros: None, venv: Path) -> None:
    site = site_packages(venv)
    before = {path.name for path in site.iterdir()}
    links = link_modules(site)
    assert link_modules(site) == links  # again is harmless
    assert "rospy" in links.modules
    assert "numpy" not in links.modules + links.borrowed
    code = """
import importlib.util, sys, unittest.mock
sys.modules["yaml"] = sys.modules["numpy"] = unittest.mock.MagicMock()  # which this empty environment lacks, and ROS imports
import rospy, std_msgs.msg
print(*map(importlib.util.find_spec, ("apt", "apt_pkg", "tf2_ros")), sep="|")
"""
    done = subprocess.run([venv / "bin" / "python", "-I", "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.startswith("None|None|"), done.stderr
    assert unlink_modules(site)
    assert not unlink_modules(site)
    assert {path.name for path in site.iterdir()} == before


def test_only_virtual_environments_are_linked_into(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="it has no pyvenv"):
        site_packages(tmp_path)


def test_where_ros_is_not_there_is_nothing_to_link(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if PathFinder.find_spec("rospy") is not None:
        pytest.skip("rospy is installed in this environment itself")
    from frobs_ros import link

    for module in (environment, link):
        monkeypatch.setattr(module, "DISTRIBUTION", tmp_path)
        monkeypatch.setattr(module, "SYSTEM", tmp_path)
    monkeypatch.setattr(link, "find_ros", lambda: None)
    with pytest.raises(RosNotFoundError, match="apt-get install"):
        link_modules(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_ros_is_found_where_it_is(ros: None) -> None:
    installation = find_ros()
    assert installation is not None
    assert (installation.modules / "rospy" / "__init__.py").is_file()
    assert (installation.share / "rospy" / "package.xml").is_file()
