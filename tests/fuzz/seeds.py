"""Valid inputs to start from, and the attacks of ``tests/security`` and of the readers of model files."""

from __future__ import annotations

import io
import json
import shutil
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from server import Server, prepare

ROOT = Path(__file__).parents[2]
TESTS = ("tests/security", "tests/models", "plugins/frobs-models/tests")
sys.path[:0] = [str(ROOT / folder) for folder in TESTS]

KINDS = ("robot", "mesh", "yaml", "bundle", "run", "model", "package")
"""Kinds of inputs that are files. Command lines are a kind of their own."""

SHIPPED = (
    "tests/docs/files/my_arm.urdf",
    "tests/docs/files/my_arm.urdf.xacro",
    "tests/docs/files/my_rover.urdf",
    "plugins/frobs-models/tests/demo.xml",
    "tests/contracts/arm.urdf.xacro",
    "tests/external_plugins/acme-robot-scara/src/acme_robot_scara/models/scara.urdf",
    "plugins/frobs-robots-abb/src/frobs_robots_abb/models/irb120.urdf.xacro",
    "plugins/frobs-grippers/src/frobs_grippers/models/two_finger_hand.urdf.xacro",
    "plugins/frobs-robots-kobuki/src/frobs_robots_kobuki/models/kobuki.urdf.xacro",
)
XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
WITH_MESH = """<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<visual><geometry><mesh filename="{0}" scale="1 1 1"/></geometry></visual>
<collision><geometry><mesh filename="{0}"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="9"/></joint></robot>
"""
MJCF_PARTS = """<mujoco model="m"><compiler angle="radian"/><include file="part.xml"/><worldbody><body name="base">
<geom type="box" size=".1 .1 .1"/><body name="arm" pos="0 0 .2"><joint name="j" axis="0 1 0" range="-1 1"/>
<geom type="mesh" mesh="m"/></body></body></worldbody><actuator><position name="a" joint="j" kp="10"/></actuator></mujoco>
"""


@dataclass(frozen=True)
class Seed:
    """An input.

    Attributes:
        name: Name in reports.
        folder: Folder whose content is copied into the working directory of a command.
        main: Path that the command receives, relative to the folder.
        attack: Whether the input is hostile without a mutation.
    """

    name: str
    folder: Path
    main: str
    attack: bool = False


def make(server: Server, folder: Path) -> dict[str, list[Seed]]:
    """Write all inputs into a folder and return them by kind."""
    found: dict[str, list[Seed]] = {kind: [] for kind in KINDS}

    def add(kind: str, name: str, files: dict[str, str | bytes], *, attack: bool = False) -> None:
        place = folder / kind / f"{len(found[kind])}"
        for path, content in files.items():
            (place / path).parent.mkdir(parents=True, exist_ok=True)
            data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
            (place / path).write_bytes(data)
        found[kind].append(Seed(name, place, next(iter(files)), attack))

    def add_tree(kind: str, name: str, tree: Path, main: str) -> None:
        place = folder / kind / f"{len(found[kind])}"
        shutil.copytree(tree, place / main)
        found[kind].append(Seed(name, place, main))

    for path in SHIPPED:
        add("robot", path, {Path(path).name: (ROOT / path).read_bytes()})
    add("robot", "MJCF with parts", {"r.xml": MJCF_PARTS, "part.xml": '<mujoco><asset><mesh name="m" file="m.stl"/></asset></mujoco>',
                                     "m.stl": dict(meshes())["m.stl"]["m.stl"]})  # fmt: skip
    for name, text in robot_attacks():
        add(
            "robot",
            name,
            {("r.urdf.xacro" if "xmlns:xacro" in text else "r.xml" if "<mujoco" in text else "r.urdf"): text},
            attack=True,
        )
    for name, files in meshes():
        add("mesh", name, {"r.urdf": WITH_MESH.format(name), **files})
    from test_sizes import LARGE_MESHES

    for name, text in LARGE_MESHES.items():
        add("mesh", name, {"r.urdf": WITH_MESH.format(name), name: text.encode("latin-1")}, attack=True)

    work = prepare(folder / "made")
    settings = [
        "--num-envs",
        "1",
        "--seed",
        "0",
        "--set",
        "algorithm_config.n_steps=32",
        "--set",
        "checkpoint_every=32",
    ]
    for words in (
        ["train", "CartPole-v1", "--steps", "64", "--run-dir", "my_run", *settings],
        ["evaluate", "my_run", "--episodes", "2"],
        ["export", "my_run", "--out", "policy.frobs"],
    ):
        result = server.run(folder / "made", words, cpu=120, idle=120)
        assert result["code"] == 0, result
    shutil.rmtree(work / "my_run" / "tensorboard", ignore_errors=True)
    add_tree("run", "CartPole-v1", work / "my_run", "my_run")
    bundle = (work / "policy.frobs").read_bytes()
    add("bundle", "CartPole-v1", {"policy.frobs": bundle})
    reach = ROOT / "plugins/frobs-tasks-reach/src/frobs_tasks_reach/pretrained/irb120reach.frobs"
    add("bundle", "frobs/Irb120Reach-v0", {"policy.frobs": reach.read_bytes()})
    for name, changes in bundle_attacks():
        add("bundle", name, {"policy.frobs": reconfigured(reach.read_bytes(), changes)}, attack=True)

    add("yaml", "settings of a run", {"config.yaml": (work / "my_run" / "config.yaml").read_bytes()})
    add("yaml", "settings of a robot", {"config.yaml": ROBOT_SETTINGS})
    space = ROOT / "plugins/frobs-algos-sb3/src/frobs_algos_sb3/search/ppo.yaml"
    add("yaml", "search space", {"config.yaml": space.read_bytes()})
    legacy = ROOT / "plugins/frobs-rl-compat/tests/old_gym_package"
    add("yaml", "FRobs_RL's settings", {"config.yaml": (legacy / "config/td3.yaml").read_bytes()})
    from test_xacro_work import YAML

    for name, text in YAML.items():
        add("yaml", name, {"config.yaml": text}, attack=True)
    add_tree("package", "FRobs_RL package", legacy, "package")
    add("model", "stable-baselines3", {"model.zip": sb3_model()})
    return found


ROBOT_SETTINGS = """environment: frobs/Irb120Reach-v0
environment_kwargs:
  simulator: mujoco
  controller: joint_delta_position
  tolerance: 0.05
  home: {joint_1: 0.1}
  observations: {'*': null, forces: {sensor: contact}}
randomize:
  mass: {scale: [0.9, 1.1]}
algorithm: sac
algorithm_config: {learning_rate: 0.001, buffer_size: 1000, policy_kwargs: {net_arch: [16]}}
wrappers:
- name: gymnasium.wrappers:RescaleAction
  min_action: -0.5
  max_action: 0.5
callbacks: []
num_envs: 1
steps: 32
seed: 1
"""


def robot_attacks() -> Iterator[tuple[str, str]]:
    """Yield the robots of the tests of hostile files."""
    from test_hostile_robots import HOSTILE
    from test_sizes import LARGE_MJCF, LARGE_URDF
    from test_xacro_expressions import OTHER_WAYS
    from test_xacro_work import EXPRESSIONS, FILES

    for name, (elements, _) in HOSTILE.items():
        yield name, f'<robot name="r">{"".join(elements)}</robot>'
    yield from LARGE_MJCF.items()
    yield from LARGE_URDF.items()
    for name, text in FILES.items():
        yield name, XACRO.format(text)
    for text in (*EXPRESSIONS, *OTHER_WAYS):
        yield text[:40], XACRO.format(f'<link name="${{{text}}}"/>')


def meshes() -> Iterator[tuple[str, dict[str, bytes]]]:
    """Yield a box in each format: the name of its file, and all its files."""
    import trimesh

    box = trimesh.creation.box((0.2, 0.4, 0.6))
    for ending in ("stl", "ply", "off", "glb", "dae"):
        yield f"m.{ending}", {f"m.{ending}": _bytes(box.export(file_type=ending))}
    yield "ascii.stl", {"ascii.stl": _bytes(box.export(file_type="stl_ascii"))}
    lines = [
        *(f"v {x} {y} {z}" for x, y, z in box.vertices),
        "usemtl a",
        *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in box.faces),
    ]
    yield (
        "m.obj",
        {"m.obj": "\n".join(["mtllib m.mtl", *lines, ""]).encode(), "m.mtl": b"newmtl a\nKd 1 0 0\nmap_Kd a.png\n"},
    )
    tree: Any = trimesh.exchange.gltf.export_gltf(trimesh.Scene(box))
    main = next(name for name in tree if name.endswith(".gltf"))
    yield "m.gltf", {("m.gltf" if name == main else name): _bytes(data) for name, data in tree.items()}


def _bytes(data: Any) -> bytes:
    return data if isinstance(data, bytes) else str(data).encode()


def bundle_attacks() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield changes to the configuration that a bundle names."""
    from test_bundles import ALLOWED, REFUSED

    yield from REFUSED.items()
    yield from ALLOWED.items()
    yield (
        "stacked frames",
        {
            "wrappers": [{"name": "gymnasium.wrappers:FrameStackObservation", "stack_size": 100}] * 4,
        },
    )
    yield "a large map", {"environment": "FrozenLake-v1", "environment_kwargs": {"desc": ["F" * 3000] * 3000}}
    yield "a long step", {"environment_kwargs": {"control_timestep": 20}}
    yield "endless episodes", {"environment_kwargs": {"max_episode_steps": 10**400}}


def reconfigured(bundle: bytes, changes: dict[str, Any]) -> bytes:
    """Return a bundle whose run had other settings."""
    with zipfile.ZipFile(io.BytesIO(bundle)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    manifest = json.loads(members["bundle.json"])
    manifest["training"]["config"].update(changes)
    members["bundle.json"] = json.dumps(manifest).encode()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return buffer.getvalue()


def sb3_model() -> bytes:
    """Return a model file of stable-baselines3."""
    import stable_baselines3

    buffer = io.BytesIO()
    stable_baselines3.PPO("MlpPolicy", "CartPole-v1", n_steps=8, batch_size=8, policy_kwargs={"net_arch": [8]}).save(
        buffer
    )
    return buffer.getvalue()
