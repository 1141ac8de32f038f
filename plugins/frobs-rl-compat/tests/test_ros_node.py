from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from frobs_rl_compat.ros import ros_node
from frobs_ros.ros import master, nodes, processes

PACKAGES = Path(__file__).parent / "packages"


@pytest.fixture
def running(own_master: str) -> Iterator[None]:
    yield
    ros_node.ros_kill_all_nodes()


@pytest.mark.usefixtures("running")
@pytest.mark.ros_feature("nodes", "ros")
@pytest.mark.ros_feature("helper functions of FRobs_RL", "ros")
def test_a_node_runs_under_its_name_and_is_killed() -> None:
    import rospy
    from std_msgs.msg import String

    assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py", name="speaker", ns="/inner", launch_new_term=False) is True
    assert "/inner/speaker" in nodes.ours()
    assert rospy.wait_for_message("/inner/words", String, timeout=20.0).data == "nothing"
    assert ros_node.ros_kill_node("/inner/speaker") is True
    assert "/inner/speaker" not in nodes.names()


@pytest.mark.usefixtures("running")
def test_a_python_node_runs_with_this_python_and_its_failure_is_logged(reasons: Callable[[], str]) -> None:
    import rospy

    assert ros_node.ros_node_from_pkg("tiny_arm", "which_python.py", launch_new_term=False)
    until = time.monotonic() + 20.0
    while not rospy.has_param("/which_python/python"):
        assert time.monotonic() < until
        time.sleep(0.05)
    assert rospy.get_param("/which_python/python") == sys.executable
    rospy.set_param("/which_python/fail", True)
    while "told to fail" not in reasons():
        assert time.monotonic() < until
        time.sleep(0.05)
    assert "which_python.py ended by itself: exit code 1" in reasons()


@pytest.mark.slow
@pytest.mark.usefixtures("running")
@pytest.mark.ros_feature("nodes", "ros")
@pytest.mark.ros_feature("helper functions of FRobs_RL", "ros")
def test_all_our_nodes_are_killed_and_no_other() -> None:
    import rospy

    assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py", name="one", output=None)
    assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py", name="two", output="log")
    program = ros_node.find_node("tiny_arm", "talk.py")
    from frobs_ros.ros.environment import child_variables

    foreign = subprocess.Popen([program, "__name:=foreign"], env=child_variables())
    try:
        until = time.monotonic() + 20.0
        while "/foreign" not in nodes.names():
            assert time.monotonic() < until
            time.sleep(0.05)
        assert nodes.ours() >= {"/one", "/two"}
        assert ros_node.ros_kill_all_nodes() is True
        assert not {"/one", "/two"} & nodes.ours()
        assert nodes.pid_of("/foreign") == foreign.pid
        assert nodes.pid_of(rospy.get_name()) == os.getpid()
    finally:
        foreign.terminate()
        foreign.wait()


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (["no_package", "talk.py"], "no ROS package is named 'no_package'"),
        (["tiny_arm", "walk.py"], "Did you mean 'talk.py'?"),
        (["tiny_arm", "fail.sh"], "the process ended immediately with exit code 3"),
    ],
)
def test_a_node_that_does_not_run_is_refused_with_a_reason(
    own_master: str, given: list[str], reason: str, reasons: Callable[[], str]
) -> None:
    assert ros_node.ros_node_from_pkg(*given, launch_new_term=False) is False
    assert reason in reasons()


def test_a_node_that_is_not_there_cannot_be_killed(own_master: str, reasons: Callable[[], str]) -> None:
    assert ros_node.ros_kill_node("nobody") is False
    assert "no node is named '/nobody'" in reasons()


def test_an_output_that_is_none_is_refused(reasons: Callable[[], str]) -> None:
    assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py", output="paper") is False
    assert "output is 'paper'" in reasons()


def test_a_node_needs_a_master_and_starts_one_when_told_to(
    lonely: str, monkeypatch: pytest.MonkeyPatch, reasons: Callable[[], str]
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(PACKAGES))
    assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py") is False
    assert f"no ROS master responds at {lonely}" in reasons()
    before = set(processes.owned())
    assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py", launch_master=True, launch_new_term=False) is True
    assert master.is_online()
    ours = [process for process in processes.owned() if process not in before]
    assert sorted(process.kind for process in ours) == ["master", "node"]
    assert processes.stop(ours)
    assert not master.is_online()


def test_a_master_of_somebody_else_is_not_killed(lonely: str, reasons: Callable[[], str]) -> None:
    from frobs_ros.ros.environment import child_variables

    foreign = subprocess.Popen(["rosmaster", "--core", "-p", lonely.rpartition(":")[2]], env=child_variables())
    try:
        until = time.monotonic() + 20.0
        while not master.is_online():
            assert time.monotonic() < until
            time.sleep(0.05)
        assert ros_node.ros_kill_master() is False
        assert "the master was not stopped, because another process started it" in reasons()
        assert master.is_online()
    finally:
        foreign.terminate()
        foreign.wait()


@pytest.mark.slow
def test_our_own_master_and_all_else_that_is_ours_is_killed(ros: None) -> None:
    script = """
from frobs_ros.ros import master, processes
from frobs_rl_compat.ros import ros_node
assert master.ensure() is not None
assert ros_node.ros_node_from_pkg("tiny_arm", "talk.py", launch_new_term=False)
assert ros_node.ros_kill_master() is True
assert not master.is_online()
assert [p.kind for p in processes.owned()] == ["node"]
assert ros_node.ros_kill_master() is True
assert ros_node.ros_kill_all_processes() is True
assert processes.owned() == []
print("done")
"""
    done = run_alone(script)
    assert done.stdout.endswith("done\n"), done.stderr


def run_alone(script: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a process of its own, with a master's port of its own."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{found.getsockname()[1]}"
    variables = dict(os.environ, ROS_MASTER_URI=uri, ROS_PACKAGE_PATH=str(PACKAGES))
    return subprocess.run([sys.executable, "-c", script], env=variables, capture_output=True, text=True, check=False)
