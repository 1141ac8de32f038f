"""Parts of the policy node against the environments in which policies are trained."""

import ast
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import frobs_deploy
import frobs_ros2
from frobs_core.plugins.registry import pretrained_path
from frobs_core.util.plain import to_json
from frobs_deploy import Policy, read_bundle
from frobs_ros2.errors import SettingsError
from frobs_ros2.policy_node.actions import Actions
from frobs_ros2.policy_node.checks import bundle_problems
from frobs_ros2.policy_node.kinematics import Kinematics
from frobs_ros2.policy_node.node import PolicyNode, Settings
from frobs_ros2.policy_node.observation import Inputs, Observer, named_arrays
from frobs_ros2.serve.measurements import robot_description, transforms
from frobs_ros2.serve.trajectory import Trajectory

SOURCES = Path(frobs_ros2.__file__).parent
WITHOUT_CORE = [SOURCES / "ros.py", SOURCES / "errors.py", SOURCES / "safety.py", *SOURCES.glob("policy_node/*.py")]
WITHOUT_CORE += Path(frobs_deploy.__file__).parent.glob("*.py")


def environment(id: str, **kwargs: Any) -> Any:
    return gym.make(f"frobs_core:{id}", disable_env_checker=True, **kwargs).unwrapped


@pytest.mark.parametrize(
    ("id", "controller"),
    [
        ("frobs/Irb120Reach-v0", "joint_delta_position"),
        ("frobs/Irb120ReachGoal-v0", "joint_position"),
        ("frobs/Ur5ReachVelocity-v0", "joint_velocity"),
        ("frobs/Ur5Reach-v0", "joint_effort"),
    ],
)
def test_observations_and_commands_equal_those_of_the_environment(id: str, controller: str) -> None:
    env = environment(id, controller=controller)
    bundle = read_bundle(pretrained_path(id))
    manifest = Policy(bundle).manifest
    kinematics = Kinematics(robot_description(env.robot), manifest.joint_names)
    observer = Observer(manifest, bundle.manifest["robot"]["tcp"], kinematics)
    robot = env.robot
    names = ("position_lower", "position_upper", "velocity_limit", "effort_limit")
    limits = np.array([getattr(robot, name)[0] for name in names])
    actions = Actions(controller, {"max_delta": 0.15}, (), manifest.joint_names, limits, env.control_timestep)
    sent: list[Any] = []
    command = robot.command
    robot.command = lambda values: (sent.append(values.copy()), command(values))
    observation, _ = env.reset(seed=2)
    actions.reset(robot.joint_positions[0])
    rng = np.random.default_rng(0)
    for _ in range(10):
        inputs = Inputs(
            joint_positions=robot.joint_positions[0].copy(),
            joint_velocities=robot.joint_velocities[0].copy(),
            goal=env.task.goal[0].copy(),
        )
        read = observer.read(inputs)
        for key in manifest.observation:
            ours, theirs = (read, observation) if key == "" else (read[key], observation[key])  # type: ignore[index]
            np.testing.assert_allclose(ours, theirs, atol=1e-5)
        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
        if controller == "joint_effort":
            action *= 0.001
        ours = actions.convert(action, inputs.joint_positions)
        observation, *_ = env.step(action)
        np.testing.assert_allclose(ours, sent[-1][0], atol=1e-9)
    env.close()


FREE = {"free_yaw": True, "axes": ["x", "z", "rx"]}
GRIPPERS = ("gripper_position", "gripper_delta", "gripper_binary")


@pytest.mark.parametrize(
    ("id", "kwargs"),
    [
        *[("frobs/Ur5PickAndPlace-v0", {"controller": {"arm": "tcp_delta_pose", "gripper": name}}) for name in GRIPPERS],
        ("frobs/Ur5Reach-v0", {"controller": "tcp_delta_pose", "controller_kwargs": FREE}),
        ("frobs/Irb120Reach-v0", {"controller": "tcp_delta_position"}),
        ("frobs/KobukiMaze-v0", {}),
    ],
)  # fmt: skip
def test_commands_equal_those_of_controllers_with_laws(id: str, kwargs: dict[str, Any]) -> None:
    env = environment(id, **kwargs)
    robot, joints = env.robot, env.robot.joint_names
    kinematics = Kinematics(robot_description(robot), joints)
    laws = json.loads(to_json([controller.law() for controller in env.control.controllers.values()]))
    name = str(laws[0]["law"])
    actions = Actions(name, {}, laws, joints, np.zeros((4, len(joints))), env.control_timestep, kinematics)
    sent: list[Any] = []
    command = robot.command
    robot.command = lambda values: (sent.append(values.copy()), command(values))
    env.reset(seed=2)
    actions.reset(robot.joint_positions[0])
    rng = np.random.default_rng(0)
    action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
    for step in range(60):
        if step % 6 == 0:  # keeps its direction, so that joints and the tool reach their limits
            action = rng.uniform(-1.5, 1.5, env.action_space.shape).astype(np.float32)
        ours = actions.convert(action, robot.joint_positions[0].copy())
        env.step(action)
        if name == "differential_drive":
            drive = robot.robot.differential_drive
            ours = (ours[0] + 0.5 * drive.separation * np.array([-1.0, 1.0]) * ours[1]) / drive.wheel_radius
        np.testing.assert_allclose(ours, sent[-1][0], atol=1e-6)
    env.close()


def test_other_terms_come_by_name() -> None:
    named = named_arrays(["episode", "cube/0", "cube/1", "success"], [3.0, 1.0, 2.0])
    assert {name: value.tolist() for name, value in named.items()} == {"episode": [3.0], "cube": [1.0, 2.0]}
    names = sorted(f"pose/{i}" for i in range(12))  # 0, 1, 10, 11, 2, …
    named = named_arrays(names, [float(name.partition("/")[2]) for name in names])
    assert named["pose"].tolist() == list(range(12))


def test_term_of_another_size_is_missing() -> None:
    bundle = read_bundle(pretrained_path("frobs/PandaPush-v0"))
    observer = Observer(Policy(bundle).manifest, bundle.manifest["robot"]["tcp"], None)
    named = {name: np.zeros(width) for name, width in observer.widths.items()}
    observer.read(Inputs(named=named))
    name = next(name for name, width in observer.widths.items() if width > 1)
    named[name] = np.ones(1)
    with pytest.raises(KeyError, match=name):
        observer.read(Inputs(named=named))


def test_joint_states_of_another_node_are_not_taken_for_those_of_the_robot() -> None:
    node: Any = object.__new__(PolicyNode)  # without topics
    node.policy = SimpleNamespace(manifest=SimpleNamespace(joint_names=("a", "b")))
    node._inputs, node._stamps, node._other_names, node._fresh = Inputs(), [], [], False

    def publish(names: list[str], seconds: int) -> bool:
        header = SimpleNamespace(stamp=SimpleNamespace(sec=seconds, nanosec=0))
        positions = [float(seconds)] * len(names)
        node._fresh = False
        node._on_joints(SimpleNamespace(header=header, name=names, position=positions, velocity=[], effort=[]))
        return bool(node._fresh)

    assert publish(["b", "a"], 1)
    assert not publish(["finger"], 2)
    assert node._inputs.stamp == 1.0
    assert node._stamps == [1.0]
    assert publish(["a", "b", "finger"], 3)
    assert node._inputs.joint_positions.tolist() == [3.0, 3.0]


def test_inputs_that_fall_silent_are_named() -> None:
    node: Any = object.__new__(PolicyNode)
    node._settings, node._inputs = Settings(bundle=Path()), Inputs()
    node._watched, node._heard = ["wrist/image_raw", "observation"], {}
    image = SimpleNamespace(encoding="rgb8", height=1, width=1, step=3, data=bytes(3), is_bigendian=0)
    stamp = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))
    assert node._silent() == "wrist/image_raw"
    node._on_image("wrist", image)
    assert node._silent() == "observation"
    node._on_numbers(SimpleNamespace(header=stamp, name=["cube/0"], position=[0.5]))
    assert node._silent() == ""
    node._heard["wrist/image_raw"] -= 2.0
    assert node._silent() == "wrist/image_raw"


@pytest.mark.parametrize(("drives", "mode"), [(True, "velocity"), (False, "effort")])
def test_workspace_that_cannot_be_kept_is_an_error(drives: bool, mode: str) -> None:
    node: Any = object.__new__(PolicyNode)
    node.kinematics, node._bundle = None, read_bundle(pretrained_path("frobs/Irb120Reach-v0"))
    node._settings = Settings(bundle=Path(), workspace=[0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    node._drives, node._actions = drives, SimpleNamespace(mode=mode)
    with pytest.raises(SettingsError, match="workspace: the commands of this policy"):
        node._tool()


@pytest.mark.parametrize("id", ["frobs/Ur5PickAndPlace-v0", "frobs/PandaPush-v0", "frobs/KobukiMaze-v0"])
def test_transforms_lead_from_the_world_to_each_link(id: str) -> None:
    from frobs_core.util.rotations import quat_multiply, quat_rotate

    env = environment(id)
    env.reset(seed=0)
    handle = env.robot
    found = {child: row for moving in (True, False) for row in transforms(handle, "", moving) for child in [row[1]]}
    pos, quat = (each[0] for each in handle.link_poses())
    for i, link in enumerate(handle.model.links):
        at, turn, name = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), link.name
        chain = []
        while name in found:
            chain.append(found[name])
            name = found[name][0]
        assert name in ("world", "odom")
        for _, _, step, rotation in reversed(chain):
            at, turn = at + quat_rotate(turn, step), quat_multiply(turn, rotation)
        np.testing.assert_allclose(at, pos[i], atol=1e-9)
        np.testing.assert_allclose(np.abs(turn @ quat[i]), 1.0, atol=1e-9)
    env.close()


def test_bundle_whose_controllers_cannot_be_converted_is_named() -> None:
    bundle = read_bundle(pretrained_path("frobs/PandaPush-v0"))
    (problem,) = bundle_problems(bundle, (), "forward")
    assert "numbers of its controller 'tcp_delta_pose'" in problem
    law = {"law": "tcp_delta_pose", "interpolate": True, "joints": ["elsewhere"]}
    problems = " ".join(bundle_problems(bundle, [law], "forward"))
    assert "--interface trajectory" in problems
    assert "the joints elsewhere" in problems
    other = {**bundle.manifest, "controller": {"name": "tcp_impedance"}}
    (problem,) = bundle_problems(replace(bundle, manifest=other), (), "forward")
    assert "tcp_impedance" in problem
    assert "frobs evaluate ID --policy FILE --simulator ros2" in problem


JOINT = '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/></joint>'
LOOP = f"<robot>{JOINT.format('x', 'a', 'b')}{JOINT.format('y', 'b', 'a')}</robot>"


@pytest.mark.parametrize("text", ["<robot", "<!DOCTYPE x [<!ENTITY a 'b'>]><robot/>", "<robot><joint/></robot>", LOOP])
def test_invalid_robot_description_is_rejected(text: str) -> None:
    with pytest.raises(SettingsError):
        Kinematics(text, ())


def message(names: list[str], *points: tuple[float, list[float], list[float]]) -> Any:
    rows = [
        SimpleNamespace(
            positions=positions,
            velocities=velocities,
            time_from_start=SimpleNamespace(sec=0, nanosec=round(1e9 * time)),
        )
        for time, positions, velocities in points
    ]
    return SimpleNamespace(joint_names=names, points=rows)


def follow(*points: tuple[float, list[float], list[float]], names: tuple[str, ...] = ("b", "a")) -> Trajectory:
    return Trajectory(message(list(names), *points), ["a", "b"], np.zeros(2), -np.ones(2), np.ones(2))


def test_trajectory_is_linear_or_cubic() -> None:
    linear = follow((0.5, [0.2, 0.4], []))
    assert linear.columns.tolist() == [1, 0]
    np.testing.assert_allclose(linear.sample(0.25), [0.1, 0.2])
    np.testing.assert_allclose(linear.sample(9.0), [0.2, 0.4])
    cubic = follow((0.5, [0.2, 0.4], [0.0, 0.0]))
    np.testing.assert_allclose(cubic.sample(0.25), [0.1, 0.2])
    np.testing.assert_allclose(cubic.sample(0.125), [0.2 * 0.15625, 0.4 * 0.15625])


@pytest.mark.parametrize(
    "points",
    [
        [(0.5, [0.2], [])],
        [(0.5, [0.2, np.nan], [])],
        [(0.5, [0.2, 1.2], [])],
        [(0.5, [0.2, 0.2], []), (0.5, [0.3, 0.2], [])],
        [],
    ],
    ids=["too few positions", "NaN", "beyond a limit", "times do not increase", "no points"],
)
def test_unsafe_trajectory_is_rejected(points: Any) -> None:
    with pytest.raises(SettingsError):
        follow(*points)


def test_unknown_joint_is_rejected() -> None:
    with pytest.raises(SettingsError, match="from a, b"):
        follow((0.5, [0.2, 0.2], []), names=("a", "c"))


@pytest.mark.parametrize("path", WITHOUT_CORE, ids=lambda path: path.stem)
def test_policy_node_is_python_3_10_and_does_not_import_the_core(path: Path) -> None:
    tree = ast.parse(path.read_text("utf-8"), feature_version=(3, 10))
    names = {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    names |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    parts = {tuple(name.split(".")[:2]) for name in names}
    core = {part for part in parts if part[0] in ("frobs_core", "frobs_cli", "frobs_models")}
    assert not core | parts & {("frobs_ros2", name) for name in ("serve", "cli", "simulation", "safe")}
