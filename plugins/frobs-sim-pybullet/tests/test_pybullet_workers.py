"""Worker processes: they equal this one, they say how they ended, and they outlive nobody."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import replace
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import pytest
from robots import place

from frobs_core.description import Body, Contact, Scene
from frobs_core.models import Box, Collision, Mesh, Pose, Sphere
from frobs_core.util.errors import ModelFileError, SimulationError
from frobs_sim_pybullet.pool import Pool
from frobs_sim_pybullet.simulation import PybulletSimulation

SCENE = Scene(
    bodies={
        "cube": Body(geometry=Box((0.1, 0.1, 0.1)), pose=Pose((0.25, 0.02, 0.4)), mass=0.3),
        "ball": Body(geometry=Sphere(0.06), pose=Pose((0.24, 0.0, 0.6)), mass=0.2),
    },
    contacts={"cube": Contact(first="cube")},
)


def simulate(folder: Path, num_envs: int = 3, num_threads: int = 2, scene: Scene = SCENE) -> PybulletSimulation:
    return PybulletSimulation(
        {"robot": place(folder, "arm")}, scene, num_envs=num_envs, physics_timestep=0.002, num_threads=num_threads
    )


def processes(sim: PybulletSimulation) -> list[BaseProcess]:
    assert isinstance(sim._backend, Pool)
    return sim._backend.processes


def play(sim: PybulletSimulation, rows: slice = slice(None), seed: int = 0, steps: int = 15) -> bytes:
    """Push things about with the arm; return all that can be read."""
    seen = []
    rng = np.random.default_rng(seed)
    arm = sim.robots["robot"]
    for k in range(steps):
        arm.command(rng.uniform(-1.5, 1.5, (3, 2))[rows])
        if k == 4:
            sim.apply_wrench("cube", np.array([0.5, 0.0, 1.0]), np.zeros(3))
        sim.step(20)
        seen += [arm.joint_positions, arm.joint_efforts, *arm.frame_pose("tcp"), arm.frame_jacobian("tcp")]
        seen += [*sim.bodies["cube"].pose, *sim.bodies["ball"].twist, sim.contact_force("cube")]
    return b"".join(np.asarray(array).tobytes() for array in seen)


def test_workers_equal_this_process_and_each_environment_alone(tmp_path: Path) -> None:
    with_workers, here = simulate(tmp_path), simulate(tmp_path, num_threads=1)
    assert play(with_workers) == play(here)
    assert with_workers.contact_force("cube").any()
    for i in range(3):
        alone = simulate(tmp_path, num_envs=1)
        play(alone, slice(i, i + 1))
        assert alone.bodies["cube"].pose[0][0].tolist() == here.bodies["cube"].pose[0][i].tolist()
        assert alone.robots["robot"].joint_positions[0].tolist() == here.robots["robot"].joint_positions[i].tolist()
    saved = with_workers.snapshot()
    here.restore(saved)
    assert play(with_workers, seed=1) == play(here, seed=1)
    origins, directions = np.tile([0.0, 1.0, 2.0], (3, 2, 1)), np.tile([0.0, 0.0, -1.0], (3, 2, 1))
    assert with_workers.rays(origins, directions, 9.0) == pytest.approx(np.full((3, 2), 2.0))
    with_workers.close()
    here.close()


def test_a_reset_after_any_history_equals_a_fresh_simulation(tmp_path: Path) -> None:
    used, fresh = (simulate(tmp_path, num_threads=1) for _ in range(2))
    for seed in (3, 4):
        play(used, seed=seed)
        used.reset(np.array([True, False, True]))
    used.reset()
    assert play(used) == play(fresh)


def test_a_snapshot_in_the_midst_of_contacts_continues_exactly_in_any_simulation(tmp_path: Path) -> None:
    sim, other = (simulate(tmp_path, num_threads=1) for _ in range(2))
    play(sim, steps=8)
    kept = sim.snapshot()
    expected = play(sim, seed=7)
    play(other, seed=5, steps=4)
    for each in (sim, other):
        each.restore(kept)
        assert play(each, seed=7) == expected


def test_a_killed_worker_is_told_of_and_takes_all_with_it(tmp_path: Path) -> None:
    sim = simulate(tmp_path, num_threads=3)
    sim.step(1)
    first, second = processes(sim)
    os.kill(second.pid or 0, signal.SIGKILL)
    for _ in range(2):
        with pytest.raises(SimulationError, match="environments 2 to 2 was killed by SIGKILL"):
            sim.step(5)
    assert not first.is_alive()
    sim.close()
    with pytest.raises(SimulationError, match="closed"):
        sim.step(1)


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_of_a_step_is_told_of_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", None)
    sim = simulate(tmp_path, num_threads=3)
    sim.step(1)
    first, second = processes(sim)
    killer = threading.Timer(0.5, os.kill, (second.pid or 0, signal.SIGKILL))
    killer.start()
    with pytest.raises(SimulationError, match="killed by SIGKILL during step; create a new simulation"):
        sim.step(50_000)  # takes seconds
    killer.join()
    assert not first.is_alive()
    assert not second.is_alive()
    assert not list(temporary.iterdir())
    sim.close()


def test_an_error_in_a_worker_comes_back_with_its_traceback(tmp_path: Path) -> None:
    sim = simulate(tmp_path)
    with pytest.raises(SimulationError, match=r"AttributeError.*no_such_method") as caught:
        sim.call("no_such_method", None)
    assert "block.py" in "".join(caught.value.__notes__)
    assert not any(process.is_alive() for process in processes(sim))


@pytest.mark.slow
def test_a_model_that_a_worker_cannot_load_is_refused_as_in_this_process(tmp_path: Path) -> None:
    (tmp_path / "broken.obj").write_text("v 0 0\nf 1 2 3\n")
    placement = place(tmp_path, "arm")
    first, *others = placement.model.links
    shape = Collision(Mesh(tmp_path / "broken.obj"))
    model = replace(placement.model, links=(replace(first, collisions=(shape,)), *others))
    for num_threads in (1, 2):
        with pytest.raises(ModelFileError, match=r"broken\.obj"):
            PybulletSimulation(
                {"robot": replace(placement, model=model)},
                Scene(),
                num_envs=2,
                physics_timestep=0.002,
                num_threads=num_threads,
            )


@pytest.mark.slow
def test_forgetting_a_simulation_ends_its_workers(tmp_path: Path) -> None:
    sim = simulate(tmp_path)
    found = list(processes(sim))
    del sim
    gc.collect()
    assert [process.exitcode for process in found] == [0]


@pytest.mark.slow
def test_workers_end_with_a_process_that_is_killed(tmp_path: Path) -> None:
    place(tmp_path, "arm")
    script = tmp_path / "script.py"  # without a guard: a worker must not run it again
    script.write_text(
        "import sys, time\n"
        f"sys.path[:0] = {[str(Path(__file__).parent), str(Path(place.__globals__['__file__']).parent)]!r}\n"
        "from pathlib import Path\n"
        "from robots import place\n"
        "from frobs_core.description import Scene\n"
        "from frobs_sim_pybullet.simulation import PybulletSimulation\n"
        f"sim = PybulletSimulation({{'robot': place(Path({str(tmp_path)!r}), 'arm')}}, Scene(), num_envs=2,\n"
        "    physics_timestep=0.002, num_threads=2)\n"
        "print(*[process.pid for process in sim._backend.processes], flush=True)\n"
        "time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        workers = [int(pid) for pid in parent.stdout.readline().split()]
        parent.kill()
    assert len(workers) == 1  # and the process itself
    deadline = time.monotonic() + 20.0
    while any(map(is_alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(is_alive, workers))


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
