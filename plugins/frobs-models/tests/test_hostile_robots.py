"""Files that nobody should bring, on every simulator: one clear error, soon, and nothing left running or lying about."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import tempfile
import time

import gymnasium as gym
import numpy as np
import pytest

import frobs_core  # noqa: F401 - registers the IDs
from frobs_core import plugins
from frobs_core.util.errors import ModelFileError

SIMULATORS = sorted(set(plugins.engines()) - {"gazebo"})  # which takes seconds to start
INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, parent: str, child: str) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        '<origin xyz="0 0 0.1"/><limit lower="-1" upper="1" velocity="1" effort="9"/></joint>'
    )


def touching(mesh: str) -> str:
    return f'{INERTIAL}<collision><geometry><mesh filename="{mesh}"/></geometry></collision>'


ARM = [link("a"), link("b"), joint("j", "a", "b")]
ENTITIES = "".join(f'<!ENTITY e{i + 1} "{f"&e{i};" * 10}">' for i in range(20))
HOSTILE = {
    "loop": ([link("r"), *ARM, joint("back", "b", "a")], "form a cycle"),
    "two parents": ([*ARM, joint("again", "a", "b")], "already the child of joint 'j'"),
    "two links of one name": ([*ARM, link("a")], "the name 'a' is already used"),
    "1,000 joints": (
        [*(link(f"l{i}") for i in range(1_001)), *(joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(1_000))],
        "the robot has 1001 links; the limit is 500",
    ),
    "20,000 links": ([link(f"l{i}") for i in range(20_000)], "it has 50,001 elements; the limit is 50,000"),
    "deep": (["<a>" * 100_000 + "</a>" * 100_000], "nested deeper than"),
    "entity bomb": ([f"<!DOCTYPE r [{ENTITIES}]>", "&e20;"], "document type|well-formed"),
    "no mesh": ([*ARM[1:], link("a", touching("none.stl"))], "none.stl"),
    "mesh that is cut off": ([*ARM[1:], link("a", touching("cut_off.stl"))], "cut_off.stl.*broken"),
    "mesh of noise": ([*ARM[1:], link("a", touching("noise.obj"))], "noise.obj.*broken"),
    "mesh beyond all measure": ([*ARM[1:], link("a", touching("huge.stl"))], "exceeds the size limit of 256 MiB"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with meshes, whose neighbour ``temporary`` takes the temporary files of all processes."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.setattr(tempfile, "tempdir", None)
    files = tmp_path / "files"
    files.mkdir()
    (files / "cut_off.stl").write_bytes(bytes(80) + b"\xff\xff\xff\x00" + bytes(500))
    (files / "noise.obj").write_bytes(np.random.default_rng(0).bytes(4096))
    with open(files / "huge.stl", "wb") as huge:
        huge.truncate(300 * 2**20)  # a hole: it takes no disk
    return files


@pytest.mark.parametrize("simulator", SIMULATORS)
@pytest.mark.parametrize(("elements", "message"), HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_file_is_refused_soon_and_leaves_nothing(folder, simulator, elements, message):
    path = folder / "robot.urdf"
    path.write_text(f'<robot name="r">{"".join(elements)}</robot>')
    start = time.process_time()
    with pytest.raises(ModelFileError, match=message) as caught:
        gym.make("frobs/Reach-v0", robot=str(path), simulator=simulator)
    assert time.process_time() - start < 10.0
    assert len(str(caught.value).splitlines()) == 1
    assert not multiprocessing.active_children()
    assert not list((folder.parent / "temporary").iterdir())


BIG = """
import resource, sys
from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core import plugins
from frobs_core.models import load_model
file, simulator = sys.argv[1:]
model = load_model(file)
placement = Placement(robot=Robot(model=file), model=model, command_mode=CommandMode.POSITION)
cls = plugins.get_record("simulator", simulator).load()
simulation = cls({"robot": placement}, Scene(), num_envs=1, physics_timestep=0.002)
simulation.step(10)
print(simulation.robots["robot"].joint_positions[0, 0])
simulation.close()
used = resource.getrusage(resource.RUSAGE_SELF)
peak = next(line for line in open("/proc/self/status") if line.startswith("VmHWM"))  # ru_maxrss includes the parent's
print(used.ru_utime, int(peak.split()[1]) / 2**20)
"""


@pytest.mark.slow
@pytest.mark.parametrize("simulator", SIMULATORS)
def test_a_mesh_of_50_megabytes_touches_in_bounded_time_and_memory(folder, simulator):
    count = 1_000_000
    records = np.zeros(count, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"] = 0.1 * np.random.default_rng(0).random((count, 3, 3), np.float32)
    (folder / "big.stl").write_bytes(bytes(80) + count.to_bytes(4, "little") + records.tobytes())
    path = folder / "robot.urdf"
    path.write_text(f'<robot name="r">{link("a")}{link("b", touching("big.stl"))}{ARM[2]}</robot>')
    command = [sys.executable, "-c", BIG, str(path), simulator]
    lines = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600).stdout.splitlines()
    seconds, gigabytes = (float(number) for number in lines[-1].split())
    assert abs(float(lines[-2])) < 1.0
    assert seconds < 300.0
    assert gigabytes < 4.0
    assert not list((folder.parent / "temporary").iterdir())
