from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import pytest

from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.util.files import cache_folder
from frobs_ros.errors import RosNotFoundError
from frobs_ros.ros.environment import child_variables, find_ros, set_variables
from frobs_ros.ros.overlay import links_to_modules, make_overlay


def folder_of_debian(tmp_path: Path) -> Path:
    """A folder like Debian's: modules of ROS among others."""
    for file in (
        *("roslib/__init__.py", "my_msgs/__init__.py", "my_msgs/msg/__init__.py", "gnupg.py"),
        *("numpy/__init__.py", "yaml.py"),
    ):
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    return tmp_path


def test_an_overlay_links_to_modules_of_ros_and_to_what_they_import(tmp_path: Path) -> None:
    folder = folder_of_debian(tmp_path)
    links = links_to_modules([folder, tmp_path / "none"])
    assert {"roslib": folder / "roslib", "my_msgs": folder / "my_msgs", "gnupg.py": folder / "gnupg.py"} == links


def test_modules_that_the_environment_has_are_not_linked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = folder_of_debian(tmp_path)
    (tmp_path / "mine" / "my_msgs").mkdir(parents=True)
    (tmp_path / "mine" / "my_msgs" / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path / "mine"))
    assert "my_msgs" not in links_to_modules([folder])
    assert "roslib" in links_to_modules([folder])


def test_processes_that_make_the_same_overlay_at_once_share_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    links = {f"module_{i}": Path("/nowhere") / str(i) for i in range(50)}
    with ThreadPoolExecutor(8) as pool:
        made = set(pool.map(lambda _: make_overlay(links), range(32)))
    assert len(made) == 1
    assert {path.name: path.readlink() for path in made.pop().iterdir()} == links
    assert len(list(cache_folder("ros").iterdir())) == 1
    assert make_overlay({}) != make_overlay(links)


def test_folders_of_the_cache_that_nobody_has_used_for_long_are_deleted(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    used, unused, old = (make_overlay({name: tmp_path}) for name in ("used", "unused", "old"))
    os.utime(used, (0, time.time() - 40 * 24 * 3600))
    os.utime(old, (0, time.time() - 70 * 24 * 3600))
    os.utime(unused, (0, time.time() - 40 * 24 * 3600))
    assert make_overlay({"used": tmp_path}) == used
    assert not old.exists()
    assert unused.exists()
    assert used.stat().st_mtime > time.time() - 60.0


def test_a_cache_that_cannot_be_written_is_an_error_with_advice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "frobs").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(RosNotFoundError, match=r"Not a directory.*XDG_CACHE_HOME"):
        make_overlay({})


def test_overlays_stand_behind_everything_else_and_no_finder_is_installed(ros: None) -> None:
    code = (
        "import sys; from frobs_ros.ros.environment import use_ros; before = sys.path[:], sys.meta_path[:]; use_ros()\n"
        "use_ros(); print(sys.path[:-2] == before[0] and sys.meta_path == before[1])\n"
        "import gazebo_msgs.msg"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def test_the_environments_own_numpy_stays_in_front(ros: None) -> None:
    code = "from frobs_ros.ros.environment import use_ros; use_ros(); import numpy, yaml; print(numpy.__file__, yaml.__file__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "/usr/lib/python3" not in done.stdout


def test_nothing_of_ros_is_imported_until_it_is_used() -> None:
    modules = "frobs_ros.ros.processes, frobs_ros.commands, frobs_ros.cli.serve, frobs_ros.cli.doctor_ros"
    code = f"import sys, {modules}; print([m for m in ('rospy', 'rosgraph', 'mujoco') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("name", "new"),
    [
        ("environment.use_ros", "frobs_ros.ros.environment"),
        ("log.LOG", "frobs_ros.ros"),
    ],
)
def test_modules_of_version_0_2_stay_importable(name: str, new: str) -> None:
    module, _, attribute = name.partition(".")
    with pytest.warns(FrobsDeprecationWarning, match=f"frobs_ros.{name} .* use {new}.{attribute}"):
        assert getattr(import_module(f"frobs_ros.{module}"), attribute) is getattr(import_module(new), attribute)


def test_names_of_frobs_rl_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "frobs_rl_compat"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "frobs_rl_compat", None)
    for module in ("frobs_ros", "frobs_ros.robot_basic_env"):
        with pytest.raises(ImportError, match="pip install frobs-rl-compat"):
            import_module(module).RobotBasicEnv  # noqa: B018


def test_commands_are_listed_without_the_core() -> None:
    code = "import sys, frobs_ros.commands; print('frobs_core' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "False"


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


def test_ros_is_found_where_it_is(ros: None) -> None:
    installation = find_ros()
    assert installation is not None
    assert (installation.modules / "rospy" / "__init__.py").is_file()
    assert (installation.share / "rospy" / "package.xml").is_file()
