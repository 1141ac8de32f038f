"""Where legacy packages run: a ROS graph of their own. The tests of FRobs_RL's functions share one."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ros_graph import ignore_warnings_of_rospy

import frobs_rl_compat
from frobs_ros.ros.environment import use_ros

PACKAGES = Path(__file__).parent / "packages"
_LIMIT = 900  # [s] for a script

sys.path.append(str(Path(__file__).parents[2] / "frobs-algos-sb3" / "tests"))  # stock_models
sys.path.append(str(Path(frobs_rl_compat.__file__).parent / "overlay"))  # the gym of 'frobs legacy run'


@pytest.fixture
def sandbox(tmp_path):
    """An environment that sees all that is installed here, and into which more can be installed."""
    sys.path.insert(0, str(Path(__file__).parents[3] / "tests" / "cookiecutter"))
    from sandbox import Sandbox

    sys.path.pop(0)
    return Sandbox(tmp_path / "venv")


@pytest.fixture
def fast_sandbox(sandbox, tmp_path):
    """The same, with a ``frobs`` and a ``pytest`` that start quickly."""
    with sandbox.faster(tmp_path / "programs"):
        yield sandbox


@pytest.fixture
def legacy_run() -> list[str]:
    """The words of ``frobs legacy run``."""
    use_ros()
    return [sys.executable, "-m", "frobs_cli", "legacy", "run"]


def _alone() -> list[str]:
    """Return what puts a command into a network of its own; nothing, where this user may not."""
    command = ["unshare", "-n", "sh", "-c", 'ip link set lo up; ip route add 224.0.0.0/4 dev lo; exec "$@"', "sh"]
    works = shutil.which("unshare") and shutil.which("ip") and subprocess.run([*command, "true"], capture_output=True)
    return command if works and works.returncode == 0 else []


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(params=["mujoco", pytest.param("gazebo", marks=pytest.mark.needs("gazebo"))])
def backend(request: pytest.FixtureRequest) -> str:
    """What stands behind the names of Gazebo, for FROBS_ROS_BACKEND: the bridge over MuJoCo, and over a real Gazebo 11."""
    return f"bridge:{request.param}"


@pytest.fixture
def start_in_workspace(tmp_path: Path, legacy_run: list[str]) -> Callable[..., Callable[..., subprocess.Popen[str]]]:
    """Return what starts scripts in a ROS graph of their own, with a home folder that no other process has."""
    alone = _alone()

    def prepare(packages: Path, backend: str, **variables: str) -> Callable[..., subprocess.Popen[str]]:
        (tmp_path / "home").mkdir(exist_ok=True)
        environment = {
            **os.environ,
            "ROS_PACKAGE_PATH": str(packages),
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": f"http://localhost:{11311 if alone else _free_port()}",
            "FROBS_ROS_BACKEND": backend,
            "HOME": str(tmp_path / "home"),
            "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")),  # a Gazebo may be there
            "OMP_NUM_THREADS": "1",  # small networks learn fastest so, and far faster where other tests run
            "ROS_HOME": str(tmp_path / "home" / ".ros"),
            **variables,
        }

        def start(script: Path, *arguments: str) -> subprocess.Popen[str]:
            return subprocess.Popen(
                [*alone, *legacy_run, str(script), *arguments],
                env=environment,
                cwd=tmp_path,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )

        return start

    return prepare


@pytest.fixture
def run_in_workspace(start_in_workspace: Callable[..., Any]) -> Callable[..., Callable[..., str]]:
    """Return what runs scripts in a ROS graph of their own and returns their output."""

    def prepare(packages: Path, backend: str, **variables: str) -> Callable[..., str]:
        start = start_in_workspace(packages, backend, **variables)

        def run(script: Path, *arguments: str) -> str:
            with start(script, *arguments) as process:
                try:
                    output = "".join(process.communicate(timeout=_LIMIT))
                finally:
                    process.kill()
            assert process.returncode == 0, output[-6000:]
            sys.stdout.write(output)  # pytest shows it if a later check fails
            return output

        return run

    return prepare


@pytest.fixture
def run_package(
    tmp_path: Path, run_in_workspace: Callable[..., Callable[..., str]]
) -> Callable[..., Callable[..., str]]:
    """Copy a package, and return what runs its scripts and returns their output."""

    def prepare(package: Path, backend: str) -> Callable[..., str]:
        folder = tmp_path / package.name
        shutil.copytree(package, folder)
        run = run_in_workspace(folder, backend, PYTHONPATH=str(folder / "src"))
        return lambda script, *arguments: run(folder / "scripts" / script, *arguments)

    return prepare


@pytest.fixture(scope="module")
def monkeypatch_module() -> Iterator[pytest.MonkeyPatch]:
    """What sets variables for a module."""
    with pytest.MonkeyPatch.context() as patch:
        yield patch


@pytest.fixture(scope="session")
def own_master(rosmaster: str) -> Iterator[str]:
    """The master for tests of the helpers, which find the packages of the tests and wait for nothing long; its URI."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_PACKAGE_PATH", str(PACKAGES))
        patch.setenv("FROBS_ROS_TIMEOUT", "2")
        patch.delenv("DISPLAY", raising=False)
        patch.delenv("FROBS_ROS_BACKEND", raising=False)
        yield rosmaster
    from frobs_ros.ros import processes

    processes.stop(processes.owned())


@pytest.fixture(scope="module")
def gazebo(own_master: str, simulator: str, monkeypatch_module: pytest.MonkeyPatch) -> Iterator[None]:
    """The bridge, paused, launched in gazebo_ros's place."""
    from frobs_rl_compat.gazebo.launch import close_Gazebo, launch_Gazebo
    from frobs_rl_compat.ros.logged_errors import or_raise

    monkeypatch_module.setenv("FROBS_ROS_BACKEND", f"bridge:{simulator}")
    assert or_raise(launch_Gazebo)(paused=True, gui=False, output="log", launch_new_term=False)
    yield
    close_Gazebo()


@pytest.fixture
def world(gazebo: None) -> Iterator[None]:
    """The bridge's world, paused, and without models afterwards."""
    from gazebo_msgs.srv import GetWorldProperties

    from frobs_rl_compat.ros import ros_gazebo
    from frobs_ros.ros.services import call

    ros_gazebo.gazebo_pause_physics()
    yield
    ros_gazebo.gazebo_pause_physics()
    for name in call("/gazebo/get_world_properties", GetWorldProperties).model_names:
        if name != "ground_plane":
            ros_gazebo.gazebo_delete_model(name)


@pytest.fixture
def reasons(caplog: pytest.LogCaptureFixture) -> Callable[[], str]:
    """Returns what the helpers have logged."""
    caplog.set_level("WARNING", logger="rosout.frobs_ros")
    return lambda: "\n".join(record.getMessage() for record in caplog.records if "frobs_ros" in record.name)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Pass over rospy's own warnings."""
    ignore_warnings_of_rospy(items, Path(__file__).parent)


@pytest.fixture(scope="module", autouse=True)
def graph_is_left_clean(rubbish: None) -> None:
    """Remove what the tests of each module leave in the ROS graph."""
