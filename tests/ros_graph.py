"""What the tests of frobs-ros and frobs-rl-compat share: a master, a client in this process, and bridges as processes."""

from __future__ import annotations

import contextlib
import gc
import ipaddress
import os
import signal
import socket
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

_MASTERS: list[str] = []
_MASTERS_OWN = {"/run_id", "/rosdistro", "/rosversion", "/use_sim_time", "/tcp_keepalive"}


@pytest.fixture(scope="session")
def ros() -> None:
    """Make ROS importable."""
    from frobs_ros.ros.environment import use_ros

    use_ros()


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@contextlib.contextmanager
def running_master() -> Iterator[str]:
    """A real master on a port of its own; its URI."""
    import rosgraph

    from frobs_ros.ros.environment import child_variables

    uri = f"http://127.0.0.1:{free_port()}"
    environment = {**child_variables(), "ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1"}
    environment.pop("ROS_HOSTNAME", None)
    command = ["rosmaster", "--core", "-p", uri.rpartition(":")[2]]
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        _wait(lambda: rosgraph.is_master_online(uri), 30.0, "the master does not answer")
        yield uri
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.fixture(scope="session")
def rosmaster(ros: None) -> Iterator[str]:
    """A real master on a port of its own, and this process a node there; its URI."""
    kept = {name: os.environ.get(name) for name in ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")}
    try:
        with running_master() as uri:
            import rospy

            os.environ |= {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1"}
            os.environ.pop("ROS_HOSTNAME", None)
            rospy.init_node("client", disable_signals=True)  # before any clock: it lives in real time
            _MASTERS.append(uri)
            yield uri
            _MASTERS.remove(uri)
            with (
                warnings.catch_warnings()
            ):  # the last test of the process, which need not be one with ROS, ends with this
                warnings.simplefilter("ignore", ResourceWarning)
                rospy.signal_shutdown("the tests are over")
                gc.collect()
    finally:
        for name, value in kept.items():
            os.environ.pop(name, None) if value is None else os.environ.__setitem__(name, value)


@pytest.fixture
def second_master(ros: None) -> Iterator[str]:
    """A real master of which this process is no node; its URI."""
    with running_master() as uri:
        yield uri


class BridgeProcess:
    """A bridge that runs as a process.

    Attributes:
        process: It.
        log: What it has said.
    """

    def __init__(self, arguments: list[str], log: Path) -> None:
        self.log = log
        with log.open("wb") as file:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "frobs_ros.bridge", *arguments],
                stdout=file,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def wait_until_ready(self) -> None:
        import rosgraph

        master = rosgraph.Master("/client")

        def offered() -> bool:
            assert self.process.poll() is None, self.log.read_text()
            try:
                master.lookupService("/gazebo/get_world_properties")
            except rosgraph.MasterException:
                return False
            return True

        _wait(offered, 120.0, "the bridge offers nothing")

    def stop(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                code = self.process.wait(30.0)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)
                self.process.wait()
                raise AssertionError(f"the bridge does not end: {self.log.read_text()}") from None
            assert code == 0, self.log.read_text()
            assert "Traceback" not in self.log.read_text(), self.log.read_text()


@pytest.fixture(scope="module")
def bridges(rosmaster: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., BridgeProcess]]:
    """Starts bridges with options, and ends the one before: there is one Gazebo in a graph."""
    running: list[BridgeProcess] = []

    def start(*arguments: str) -> BridgeProcess:
        while running:
            running.pop().stop()
        running.append(BridgeProcess(list(arguments), tmp_path_factory.mktemp("bridge") / "log"))
        running[-1].wait_until_ready()
        return running[-1]

    yield start
    while running:
        running.pop().stop()


@pytest.fixture(scope="session")
def listening() -> Callable[[int], set[str]]:
    """Returns the addresses that a process listens at, IPv4 and IPv6, TCP and UDP, as the kernel knows them."""

    def look(pid: int) -> set[str]:
        inodes = set()
        for link in Path(f"/proc/{pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed while we look
                inodes.add(os.readlink(link).removeprefix("socket:[").removesuffix("]"))
        found = set()
        for table in ("tcp", "tcp6", "udp", "udp6"):
            for row in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
                _, local, remote, state, *_, inode = row.split()[:10]
                is_open = state == "0A" if table.startswith("tcp") else remote.endswith(":0000")
                if inode in inodes and is_open:
                    found.add(_address(local.partition(":")[0]))
        return found

    return look


def _address(words: str) -> str:
    """Return what /proc writes as words of 32 bits, each with its bytes in this machine's order."""
    raw = b"".join(int(words[i : i + 8], 16).to_bytes(4, sys.byteorder) for i in range(0, len(words), 8))
    address = ipaddress.ip_address(raw)
    return str(getattr(address, "ipv4_mapped", None) or address)


@pytest.fixture
def lonely(monkeypatch: pytest.MonkeyPatch, ros: None) -> str:
    """A place where no ROS master is; its URI."""
    uri = f"http://127.0.0.1:{free_port()}"
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    monkeypatch.setenv("FROBS_ROS_TIMEOUT", "0.3")
    return uri


def _wait(condition: Callable[[], bool], timeout: float, complaint: str) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, complaint
        time.sleep(0.05)


@pytest.fixture(scope="module")
def rubbish() -> Iterator[None]:
    """Leave nothing to the next module: neither parameters, nor what rospy leaves to the garbage collector.

    Its warnings are passed over here; the tests of others take each for an error.
    """
    yield
    for uri in _MASTERS:
        import rosgraph

        master = rosgraph.Master("/client", uri)
        for name in {f"/{name.split('/')[1]}" for name in master.getParamNames()} - _MASTERS_OWN:
            master.deleteParam(name)
    gc.collect()


def ignore_warnings_of_rospy(items: list[pytest.Item], folder: Path) -> None:
    """Pass over rospy's own warnings: it leaves sockets to the garbage collector, and calls what Python has renamed.

    In all tests of a folder, as what one leaves over may be collected in the next.
    """
    kinds = ("ResourceWarning", "DeprecationWarning", "pytest.PytestUnraisableExceptionWarning")
    ours = "error::frobs_core.deprecation.FrobsDeprecationWarning"
    for item in items:
        if item.path.is_relative_to(folder):
            item.add_marker(pytest.mark.filterwarnings(*(f"ignore::{kind}" for kind in kinds), ours))


@pytest.fixture(
    scope="module",
    params=["mujoco", pytest.param("gazebo", marks=[pytest.mark.slow, pytest.mark.needs("gazebo")])],
)
def simulator(ros: None, request: pytest.FixtureRequest) -> str:
    """What computes behind the bridge: MuJoCo, and a real Gazebo 11."""
    return str(request.param)
