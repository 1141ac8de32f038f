"""Servers: owned, reported when they end or hang, replaced, and gone with their owner."""

from __future__ import annotations

import gc
import itertools
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Placement, Scene
from frobs_core.models import Box, Pose
from frobs_core.util.errors import SimulationError
from frobs_devkit.testing.simulator.robots import ARM, model_of
from frobs_sim_gazebo import protocol
from frobs_sim_gazebo.installation import Installation
from frobs_sim_gazebo.protocol import Op
from frobs_sim_gazebo.server import Server, ServerError
from frobs_sim_gazebo.simulation import GazeboSimulation

MODEL = (
    '<sdf version="1.6"><model name="{0}"><pose>0 0 1 0 0 0</pose><link name="link">'
    '<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model></sdf>'
)


def simulate(num_envs: int = 2) -> GazeboSimulation:
    placement = Placement(robot=ARM, model=model_of(ARM.model), command_mode=CommandMode.POSITION)
    cube = Body(geometry=Box((0.1, 0.1, 0.1)), pose=Pose((0.0, 2.0, 0.05)), mass=0.3)
    return GazeboSimulation(
        {"robot": placement}, Scene(bodies={"cube": cube}), num_envs=num_envs, physics_timestep=0.002
    )


def spawn(server: Server, name: str) -> None:
    server.call(Op.SPAWN, protocol.count(1) + protocol.texts(name, MODEL.format(name)))


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until_gone(*pids: int) -> bool:
    deadline = time.monotonic() + 20.0
    while any(map(is_alive, pids)) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not any(map(is_alive, pids))


def stop(pid: int) -> None:
    """Stop a process, and wait until all of its threads stand still."""
    os.kill(pid, signal.SIGSTOP)
    threads = Path(f"/proc/{pid}/task").glob("*/stat")
    for thread in threads:
        while thread.read_text().rpartition(")")[2].split()[0] != "T":
            time.sleep(0.005)


def test_models_come_and_go_by_name_and_what_is_wrong_is_refused_by_name(gazebo: Installation) -> None:
    server = Server(gazebo)
    try:
        assert server.version.startswith("11.")
        spawn(server, "ball")
        with pytest.raises(SimulationError, match="'ball' already exists"):
            spawn(server, "ball")
        assert server.call(Op.MODELS) == b"ball\n"
        server.call(Op.REMOVE, protocol.text("ball"))
        assert server.call(Op.MODELS) == b""
        with pytest.raises(SimulationError, match="no model 'ball'"):
            server.call(Op.REMOVE, protocol.text("ball"))
        with pytest.raises(SimulationError, match="is too short"):
            server.call(Op.SETUP, b"123")
        spawn(server, "ball")
    finally:
        server.close()
    assert not is_alive(server.process.pid)
    server.close()


def test_a_timeout_that_rospy_gives_all_sockets_does_not_end_a_server(gazebo: Installation) -> None:
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(60.0)  # as rospy does when a node starts
    try:
        server = Server(gazebo)
    finally:
        socket.setdefaulttimeout(before)
    try:
        time.sleep(0.1)  # until it waits for a request
        assert server.call(Op.MODELS) == b""
    finally:
        server.close()


def test_a_server_listens_where_nobody_reaches_it(gazebo: Installation) -> None:
    server = Server(gazebo)
    try:
        own = os.readlink(f"/proc/{server.process.pid}/ns/net")
        assert own != os.readlink("/proc/self/ns/net")
        with socket.socket() as probe:
            assert probe.connect_ex(("127.0.0.1", 11345)) != 0
    finally:
        server.close()


def test_a_killed_server_cuts_its_episode_off_and_the_reset_brings_another(
    gazebo: Installation, caplog: pytest.LogCaptureFixture
) -> None:
    sim = simulate()
    try:
        sim.write_parameter("mass", "cube", np.array([0.7]), np.array([True, False]))
        sim.step(5)
        first = sim.native[0]
        assert first is not None
        os.kill(first.process.pid, signal.SIGKILL)
        with caplog.at_level(logging.ERROR):
            sim.step(5)
        assert "environment 0 lost its Gazebo server: gzserver was killed by SIGKILL during step" in caplog.text
        assert sim.diverged is not None
        assert sim.diverged.tolist() == [True, False]
        sim.step(5)
        assert sim.time.tolist() == pytest.approx([0.01, 0.03])
        sim.reset(sim.diverged.copy())
        assert sim.diverged is None
        sim.apply_wrench("cube", np.array([0.0, 0.0, 70.0]), np.zeros(3))
        sim.step(5)
        assert sim.time.tolist() == pytest.approx([0.01, 0.04])
        lifted = sim.bodies["cube"].twist[0][:, 2]
        assert lifted == pytest.approx((70.0 / np.array([0.7, 0.3]) - 9.81) * 0.01, rel=0.05)
    finally:
        sim.close()


@pytest.mark.slow
def test_a_server_that_hangs_is_ended_and_said_so(gazebo: Installation, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FROBS_GAZEBO_TIMEOUT", "1")
    server = Server(gazebo)
    stop(server.process.pid)
    with pytest.raises(ServerError, match="did not answer for 1 s during hello"):
        server.call(Op.HELLO)
    assert until_gone(server.process.pid)


@pytest.mark.slow
def test_an_environment_that_loses_server_after_server_is_an_error(gazebo: Installation) -> None:
    sim = simulate(1)
    with pytest.raises(SimulationError, match="lost 3 consecutive Gazebo servers"):  # noqa: PT012 - one of these does
        for _ in range(3):
            server = sim.native[0]
            assert server is not None
            os.kill(server.process.pid, signal.SIGKILL)
            sim.step(1)
            sim.reset()
    sim.close()


@pytest.mark.slow
def test_forgetting_a_simulation_ends_its_servers(gazebo: Installation) -> None:
    sim = simulate()
    pids = [server.process.pid for server in sim.native if server is not None]
    del sim
    gc.collect()
    assert len(pids) == 2
    assert until_gone(*pids)


@pytest.mark.slow
def test_servers_end_with_a_process_that_is_killed(gazebo: Installation) -> None:
    script = (
        "import time; from frobs_sim_gazebo.server import Server; s = Server(); print(s.process.pid, flush=True); "
        "s.send(6, __import__('struct').pack('<III', 10**8, 1, 0)); time.sleep(60)"  # it is in the middle of steps
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
    assert until_gone(pid)


# Swings an arm by what it is told, in two environments, each time that it reads a line.
PROGRAM = """
import sys
import gymnasium as gym
env = gym.make_vec("frobs_core:frobs/Irb120Reach-v0", 2, vectorization_mode="vector_entry_point", simulator="gazebo")
env.reset(seed=0)
simulation = env.unwrapped.simulation
print(*(server.process.pid for server in simulation.native), flush=True)
for line in sys.stdin:
    for _ in range(20):
        env.step(float(line) + 0.0 * env.action_space.sample())
    print(*simulation.positions.ravel(), flush=True)
"""


class Program:
    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def hear(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        assert self.process.stdout is not None
        return np.array(self.process.stdout.readline().split(), np.float64)

    def tell(self, action: float) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{action}\n")
        self.process.stdin.flush()


@pytest.mark.slow
def test_programs_that_simulate_at_the_same_time_do_not_meet(gazebo: Installation) -> None:
    programs = [Program(), Program()]
    try:
        pids = [program.hear().astype(int).tolist() for program in programs]
        networks = {os.readlink(f"/proc/{pid}/ns/net") for pid in itertools.chain(*pids)}
        assert len(networks) == 4
        actions = (0.3, -0.3)
        for program, action in zip(programs, actions, strict=True):
            program.tell(action)  # both are under way now
        together = [program.hear() for program in programs]
        assert np.abs(together[0] - together[1]).max() > 0.1
        programs[0].process.kill()
        programs[0].process.wait()
        assert until_gone(*pids[0])
        programs[1].tell(actions[1])
        further = programs[1].hear()
        programs.append(Program())
        programs[2].hear()
        for expected in (together[1], further):
            programs[2].tell(actions[1])
            assert programs[2].hear() == pytest.approx(expected, abs=1e-9)
    finally:
        for program in programs:
            with program.process as process:
                process.kill()


def resident(pid: int) -> int:
    """Return the memory of a process [kB]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0])


@pytest.mark.slow
def test_a_thousand_models_come_and_go_without_a_leak(gazebo: Installation) -> None:
    server = Server(gazebo)
    try:
        grown = []
        names = [f"ball{i}" for i in range(10)]  # Gazebo takes new models only five times a second
        models = [MODEL.format(name).replace("<pose>0", f"<pose>{i}") for i, name in enumerate(names)]
        for cycle in range(100):
            named = itertools.chain.from_iterable(zip(names, models, strict=True))
            server.call(Op.SPAWN, protocol.count(len(names)) + protocol.texts(*named))
            server.call(Op.STEP, protocol.step(2, [[]]))
            for name in names:
                server.call(Op.REMOVE, protocol.text(name))
            if cycle in (19, 99):
                grown.append(resident(server.process.pid))
        assert server.call(Op.MODELS) == b""
        assert grown[1] - grown[0] < 20_000, grown
    finally:
        server.close()


def test_a_model_of_the_simulation_stays(gazebo: Installation) -> None:
    sim = simulate(1)
    server = sim.native[0]
    assert server is not None
    for name in ("robot.robot", "body.cube", "floor.floor"):
        with pytest.raises(SimulationError, match=f"'{name}' is part of the simulation"):
            server.call(Op.REMOVE, protocol.text(name))
    sim.step(1)
    sim.close()
