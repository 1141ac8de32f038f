from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pybullet
import pytest
from robots import place

from frobs_core.errors import ConfigurationError, RenderingUnavailableError, SimulationError, UnknownNameError
from frobs_core.interfaces import Body, Camera, CommandMode, Contact, Marker, Scene
from frobs_core.models import Box, Pose, Sphere
from frobs_sim_pybullet.simulation import PybulletSimulation


def simulate(
    folder: Path, *names: str, num_envs: int = 3, scene: Scene | None = None, **placing: object
) -> PybulletSimulation:
    robots = {("robot" if i == 0 else name): place(folder, name, **placing) for i, name in enumerate(names)}
    return PybulletSimulation(robots, scene or Scene(), num_envs=num_envs, physics_timestep=0.002, num_threads=1)


def state_of(sim: PybulletSimulation) -> bytes:
    return b"".join(array.tobytes() for array in sim.snapshot().values())


def test_reset_goes_home_and_time_advances_by_the_steps(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "arm")
    sim.reset()
    arm = sim.robots["robot"]
    assert arm.joint_positions.tolist() == [[0.3, 0.5]] * 3
    sim.step(20)
    assert sim.time == pytest.approx([0.04] * 3)


def test_poses_are_current_after_a_step(tmp_path: Path) -> None:
    for num_envs in (1, 3):
        sim = simulate(tmp_path, "arm", num_envs=num_envs)
        sim.reset()
        arm = sim.robots["robot"]
        for _ in range(5):
            arm.command(np.full((num_envs, 2), -0.5))
            sim.step(10)
            pos, quat = arm.frame_pose("tcp")
            there, turned = arm.frame_pose("tcp", arm.joint_positions)
            assert pos == pytest.approx(there, abs=1e-12)
            assert np.abs((quat * turned).sum(-1)) == pytest.approx(1.0, abs=1e-12)


def test_poses_are_current_after_a_write(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "arm")
    sim.reset()
    arm = sim.robots["robot"]
    arm.frame_pose("tcp")
    mask = np.array([False, True, False])
    arm.write_joint_state(np.array([[1.0, -1.0]]), mask=mask)
    pos, _ = arm.frame_pose("tcp")
    assert pos == pytest.approx(arm.frame_pose("tcp", arm.joint_positions)[0], abs=1e-12)
    assert arm.joint_positions[0].tolist() == [0.3, 0.5]


def test_the_jacobian_gives_the_velocity(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "long_arm")
    sim.reset()
    arm = sim.robots["robot"]
    rng = np.random.default_rng(0)
    arm.write_joint_state(rng.uniform(-1, 1, (3, 3)), rng.uniform(-1, 1, (3, 3)))
    lin, ang = arm.frame_velocity("tcp")
    expected = np.einsum("nij,nj->ni", arm.frame_jacobian("tcp"), arm.joint_velocities)
    assert np.concatenate([lin, ang], axis=1) == pytest.approx(expected, abs=1e-12)


def test_the_jacobian_is_the_derivative_of_the_pose(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "long_arm", num_envs=1)
    sim.reset()
    arm = sim.robots["robot"]
    q, h = arm.joint_positions.copy(), 1e-6
    for joint in range(3):
        dq = np.eye(3)[joint] * h
        ahead, behind = arm.frame_pose("tcp", q + dq)[0], arm.frame_pose("tcp", q - dq)[0]
        assert arm.frame_jacobian("tcp")[0, :3, joint] == pytest.approx(((ahead - behind) / (2 * h))[0], abs=1e-8)


@pytest.mark.parametrize("limit", [200.0, 3.0], ids=["free", "saturated"])
def test_the_drive_law_holds_to_the_last_digit(tmp_path: Path, limit: float) -> None:
    folder = tmp_path
    placement = place(folder, "arm")
    text = (folder / "arm.urdf").read_text().replace('effort="200"', f'effort="{limit}"')
    (folder / "arm.urdf").write_text(text)
    placement = place.__globals__["Placement"](
        robot=placement.robot,
        model=place.__globals__["load_model"](folder / "arm.urdf"),
        command_mode=CommandMode.POSITION,
    )
    sim = PybulletSimulation({"robot": placement}, Scene(gravity=(0, 0, 0)), num_envs=1, physics_timestep=0.002)
    sim.reset()
    arm = sim.robots["robot"]
    kp, kd = (gain[0] for gain in arm.drive_gains())
    target = arm.joint_positions[0] + 0.4
    native = sim.native[0]
    h = 0.002
    saturated = 0
    for _ in range(50):
        q, v = arm.joint_positions[0].copy(), arm.joint_velocities[0].copy()
        body, client = native.robots["robot"], native.client
        mass = np.array(pybullet.calculateMassMatrix(body, q.tolist(), physicsClientId=client))
        bias = pybullet.calculateInverseDynamics(body, q.tolist(), v.tolist(), [0.0, 0.0], physicsClientId=client)
        effort = kp * (target - q) - kd * v
        clipped = np.abs(effort) >= limit
        saturated += clipped.any()
        effort = np.clip(effort, -limit, limit)
        acceleration = np.linalg.solve(mass + h * np.diag(np.where(clipped, 0.0, kd)), effort - bias)
        arm.command(target[None])
        sim.step(1)
        assert arm.joint_velocities[0] == pytest.approx(v + h * acceleration, abs=1e-12)
    assert (saturated > 5) == (limit == 3.0)


def test_velocity_and_effort_commands(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "rover", mode=CommandMode.VELOCITY, pos=(0.0, 0.0, 0.071))
    sim.reset()
    rover = sim.robots["robot"]
    rover.command(np.full((3, 2), 9.0))
    sim.step(500)
    assert rover.joint_velocities == pytest.approx(np.full((3, 2), 9.0), rel=0.05)
    assert rover.base_twist[0][:, 0] == pytest.approx([0.315] * 3, rel=0.05)
    rover.set_command_mode(CommandMode.EFFORT)
    rover.command(np.full((3, 2), 0.1))
    sim.step(1)
    assert rover.joint_efforts == pytest.approx(np.full((3, 2), 0.1))


def test_a_row_of_commands_for_each_physics_step_equals_single_steps(tmp_path: Path) -> None:
    rows = np.random.default_rng(0).uniform(-1, 1, (2, 8, 2))
    one, many = (simulate(tmp_path, "arm", num_envs=2) for _ in range(2))
    one.reset(), many.reset()
    many.robots["robot"].command(rows)
    many.step(8)
    for k in range(8):
        one.robots["robot"].command(rows[:, k])
        one.step(1)
    assert state_of(one) == state_of(many)
    many.robots["robot"].command(rows)
    with pytest.raises(ConfigurationError, match="8 rows for 5"):
        many.step(5)


def test_two_different_robots_live_in_one_scene(tmp_path: Path) -> None:
    robots = {"robot": place(tmp_path, "arm"), "other": place(tmp_path, "long_arm", pos=(1.0, 0.5, 0.0))}
    sim = PybulletSimulation(robots, Scene(), num_envs=2, physics_timestep=0.002, num_threads=1)
    sim.reset()
    arm, other = sim.robots["robot"], sim.robots["other"]
    arm.command(np.array([[0.3, 0.5], [-0.3, -0.5]]))
    other.command(np.tile([0.2, -0.4, 0.1], (2, 1)))
    sim.step(500)
    assert arm.joint_positions == pytest.approx(np.array([[0.3, 0.5], [-0.3, -0.5]]), abs=0.05)
    assert other.joint_positions == pytest.approx(np.tile([0.2, -0.4, 0.1], (2, 1)), abs=0.05)
    pos, _ = other.frame_pose("tcp")
    assert pos == pytest.approx(other.frame_pose("tcp", other.joint_positions)[0], abs=1e-12)
    assert pos[0, 0] > 0.8


def test_a_floating_base_falls_and_is_placed(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "drone", pos=(0.0, 0.0, 5.0))
    sim.reset()
    drone = sim.robots["robot"]
    sim.step(100)
    assert drone.base_pose[0][:, 2] == pytest.approx([5.0 - 0.5 * 9.81 * 0.04] * 3, abs=0.005)
    turned = np.array([[np.cos(0.4), 0.0, 0.0, np.sin(0.4)]])
    mask = np.array([True, False, False])
    drone.write_base_pose(np.array([[1.0, 2.0, 3.0]]), turned, mask)
    drone.write_base_twist(np.array([[0.1, 0.2, 0.3]]), np.array([[1.0, 0.5, 0.2]]), mask)
    pos, quat = drone.base_pose
    lin, ang = drone.base_twist
    assert pos[0].tolist() == [1.0, 2.0, 3.0]
    assert quat[0] == pytest.approx(turned[0])
    assert lin[0] == pytest.approx([0.1, 0.2, 0.3])
    assert ang[0] == pytest.approx([1.0, 0.5, 0.2])
    assert drone.joint_positions.shape == (3, 1)


def test_a_fixed_base_is_moved_but_has_no_velocity(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "arm")
    sim.reset()
    arm = sim.robots["robot"]
    before = arm.frame_pose("tcp")[0].copy()
    arm.write_base_pose(np.array([0.5, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]), np.array([True, False, False]))
    assert arm.frame_pose("tcp")[0] - before == pytest.approx(np.array([[0.5, 0, 0], [0, 0, 0], [0, 0, 0]]))
    with pytest.raises(SimulationError, match="fixed base"):
        arm.write_base_twist(np.zeros(3), np.zeros(3))


def test_a_wheeled_robot_measures_walls_and_not_itself(tmp_path: Path) -> None:
    wall = Body(geometry=Box((0.1, 20.0, 1.0)), pose=Pose((2.05, 0.0, 0.5)))
    sim = simulate(tmp_path, "rover", scene=Scene(bodies={"wall": wall}), pos=(0.0, 0.0, 0.071))
    sim.reset()
    ranges = sim.robots["robot"].lidar("lidar")
    assert ranges.shape == (3, 8)
    angles = np.linspace(-3.1415, 2.3561, 8)
    expected = np.where(np.cos(angles) > 0.05, 2.0 / np.maximum(np.cos(angles), 0.05), 30.0)
    assert ranges == pytest.approx(np.tile(expected, (3, 1)), abs=1e-6)
    with pytest.raises(UnknownNameError, match="lidar"):
        sim.robots["robot"].lidar("lidra")


def test_a_contact_holds_over_the_whole_control_step(tmp_path: Path) -> None:
    bodies = {"ball": Body(geometry=Sphere(0.05), pose=Pose((1.0, 1.0, 0.06)), mass=0.2)}
    scene = Scene(
        bodies=bodies, contacts={"landed": Contact(first="ball", second="floor"), "arm": Contact(first="robot")}
    )
    sim = simulate(tmp_path, "arm", scene=scene)
    sim.reset()
    assert not sim.contact("landed").any()
    sim.step(10)
    assert not sim.contact("landed").any()
    sim.step(100)
    assert sim.contact("landed").all()
    assert (sim.contact_force("landed") > 1.0).all()
    assert not sim.contact("arm").any()
    with pytest.raises(UnknownNameError, match="landed"):
        sim.contact("landing")


def test_a_wrench_pushes_for_one_step(tmp_path: Path) -> None:
    scene = Scene(bodies={"ball": Body(geometry=Sphere(0.05), pose=Pose((0, 1, 3)), mass=2.0)}, gravity=(0, 0, 0))
    sim = simulate(tmp_path, "arm", scene=scene)
    sim.reset()
    sim.apply_wrench("ball", np.array([2.0, 0, 0]), np.zeros(3), np.array([True, False, False]))
    sim.step(100)
    sim.step(100)
    assert sim.bodies["ball"].twist[0][:, 0] == pytest.approx([0.2, 0.0, 0.0], abs=1e-9)


def test_bodies_are_read_and_written(tmp_path: Path) -> None:
    bodies = {
        "cube": Body(geometry=Box((0.1, 0.1, 0.1)), pose=Pose((1, 1, 0.05)), mass=0.2),
        "target": Body(geometry=Sphere(0.05), kinematic=True, collides=False),
        "wall": Body(geometry=Box((0.1, 1.0, 1.0)), pose=Pose((3, 0, 0.5))),
    }
    sim = simulate(tmp_path, "arm", scene=Scene(bodies=bodies))
    sim.reset()
    for name in ("cube", "target"):
        sim.bodies[name].write_pose(np.array([[0.7, 0.8, 0.9]]), mask=np.array([False, False, True]))
        assert sim.bodies[name].pose[0][2] == pytest.approx([0.7, 0.8, 0.9])
        assert sim.bodies[name].pose[0][0] != pytest.approx([0.7, 0.8, 0.9])
    with pytest.raises(SimulationError, match="static"):
        sim.bodies["wall"].write_pose(np.zeros(3))


@pytest.mark.parametrize("num_envs", [1, 3])
def test_a_snapshot_continues_exactly(tmp_path: Path, num_envs: int) -> None:
    sim = simulate(tmp_path, "arm", num_envs=num_envs)
    sim.reset()
    sim.robots["robot"].command(np.full((num_envs, 2), -0.7))
    sim.step(13)
    kept = sim.snapshot()
    sim.step(50)
    there = sim.robots["robot"].joint_positions.copy()
    sim.reset()
    sim.restore(kept)
    sim.step(50)
    assert (sim.robots["robot"].joint_positions == there).all()


def test_a_row_equals_a_single_environment_at_any_thread_count(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    commands = rng.uniform(-1, 1, (40, 5, 2))
    many = {
        threads: PybulletSimulation(
            {"robot": place(tmp_path, "arm")}, Scene(), num_envs=5, physics_timestep=0.002, num_threads=threads
        )
        for threads in (1, 2)
    }
    single = simulate(tmp_path, "arm", num_envs=1)
    for sim in (*many.values(), single):
        sim.reset()
    for command in commands:
        for sim in many.values():
            sim.robots["robot"].command(command)
            sim.step(7)
        single.robots["robot"].command(command[3:4])
        single.step(7)
        assert state_of(many[1]) == state_of(many[2])
        assert (many[1].robots["robot"].joint_positions[3] == single.robots["robot"].joint_positions[0]).all()
        assert (
            many[1].robots["robot"].frame_jacobian("tcp")[3] == single.robots["robot"].frame_jacobian("tcp")[0]
        ).all()


@pytest.mark.parametrize(
    ("name", "target", "value"),
    [
        ("mass", "robot/link_1", 3.0),
        ("stiffness", "robot", 5.0),
        ("damping", "robot", 50.0),
        ("joint_damping", "robot", 20.0),
        ("gravity", "", [0.0, 0.0, -1.6]),
    ],
)
def test_a_parameter_shows_in_the_motion_of_its_environment_alone(
    tmp_path: Path, name: str, target: str, value: float | list[float]
) -> None:
    sim = simulate(tmp_path, "arm")
    sim.reset()
    sim.write_parameter(name, target, np.array(value), np.array([False, True, False]))
    assert np.array_equal(np.broadcast_to(value, sim.parameter(name, target)[1].shape), sim.parameter(name, target)[1])
    sim.robots["robot"].command(np.full((3, 2), -1.0))
    sim.step(40)
    q = sim.robots["robot"].joint_positions
    assert (q[0] == q[2]).all()
    assert np.abs(q[1] - q[0]).max() > 1e-4
    kept = sim.snapshot()
    fresh = simulate(tmp_path, "arm")
    fresh.reset()
    fresh.restore(kept)
    sim.step(30), fresh.step(30)
    assert (fresh.robots["robot"].joint_positions == sim.robots["robot"].joint_positions).all()


def test_friction_shows_in_the_motion(tmp_path: Path) -> None:
    cube = Body(geometry=Box((0.1, 0.1, 0.1)), pose=Pose((1, 1, 0.05)), mass=0.5)
    sim = simulate(tmp_path, "arm", scene=Scene(bodies={"cube": cube}))
    sim.reset()
    sim.write_parameter("friction", "cube", np.array([0.05, 1.0, 0.05]))
    sim.write_parameter("friction", "floor", np.full(3, 0.05))
    for _ in range(20):
        sim.apply_wrench("cube", np.array([2.0, 0, 0]), np.zeros(3))
        sim.step(20)
    x = sim.bodies["cube"].pose[0][:, 0]
    assert x[0] == x[2] > x[1] + 0.1


def test_unknown_parameters_and_targets_are_named(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "arm")
    with pytest.raises(UnknownNameError, match="did you mean 'mass'".capitalize()):
        sim.parameter("masss", "robot/base")
    with pytest.raises(UnknownNameError, match="robot/link_1"):
        sim.parameter("mass", "robot/link1")
    with pytest.raises(ConfigurationError, match="negative"):
        sim.write_parameter("mass", "robot/link_1", np.array([-1.0]))


def test_a_diverged_environment_is_noticed_and_the_others_go_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    sim, healthy = (simulate(tmp_path, "arm") for _ in range(2))
    sim.reset(), healthy.reset()
    assert sim.diverged is None
    sim.robots["robot"].write_joint_state(np.array([[np.nan, 0.0]]), mask=np.array([False, True, False]))
    for each in (sim, healthy):
        each.step(20)
    assert sim.diverged is not None
    assert sim.diverged.tolist() == [False, True, False]
    assert (sim.robots["robot"].joint_positions[[0, 2]] == healthy.robots["robot"].joint_positions[[0, 2]]).all()
    sim.reset(np.array([False, True, False]))
    assert sim.diverged is None
    assert sim.robots["robot"].joint_positions[1].tolist() == [0.3, 0.5]


def test_pictures_show_what_is_there(tmp_path: Path) -> None:
    cameras = {
        "front": Camera(pos=(2, 0, 0.5), target=(0, 0, 0.3)),
        "wrist": Camera(pos=(0, 0, 0.1), target=(0, 0, 1), frame="robot/link_1"),
    }
    sim = simulate(tmp_path, "arm", scene=Scene(cameras=cameras), num_envs=2)
    sim.reset()
    rgb = sim.render(size=(48, 64))
    assert rgb.shape == (2, 48, 64, 3)
    assert rgb.dtype == np.uint8
    assert rgb.std() > 5
    depth = sim.render(np.array([False, True]), "front", (48, 64), "depth")
    assert depth.shape == (1, 48, 64, 1)
    assert 1.5 < depth[0, 24, 32, 0] < 2.2
    segments = sim.render(None, "front", (48, 64), "segmentation")
    assert segments.dtype == np.int32
    assert len(np.unique(segments)) >= 4
    assert sim.render(camera="wrist", size=(48, 64)).shape == (2, 48, 64, 3)
    with pytest.raises(UnknownNameError, match="front"):
        sim.render(camera="fornt")
    sim.close()
    sim.close()


def test_a_window_without_a_display_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(RenderingUnavailableError, match="no display"):
        simulate(tmp_path, "arm", num_envs=1).open_viewer()


def test_depth_is_in_metres_and_markers_are_drawn(tmp_path: Path) -> None:
    camera = Camera(pos=(3.0, 0.0, 1.0), target=(0.0, 0.0, 1.0))
    wall = Body(geometry=Box((0.2, 4.0, 4.0)), pose=Pose((0.0, 0.0, 2.0)), rgba=(0.0, 0.0, 1.0, 1.0))
    sim = simulate(tmp_path, "arm", num_envs=1, scene=Scene(bodies={"wall": wall}, cameras={"c": camera}, floor=False))
    sim.reset()
    depth = sim.render(size=(40, 40), modality="depth")
    assert depth[0, 20, 20, 0] == pytest.approx(2.9, abs=0.01)
    markers = [Marker(np.array([[1.0, 0.0, 1.0]]), 0.2, (1.0, 0.0, 0.0, 1.0))]
    red, green, blue = (sim.render(size=(40, 40), markers=markers)[0, 20, 20] / 255.0).tolist()
    assert red > 0.3 > max(green, blue)
    red, green, blue = (sim.render(size=(40, 40))[0, 20, 20] / 255.0).tolist()
    assert blue > 0.3 > max(red, green)
    segments = sim.render(size=(40, 40), modality="segmentation")[0, :, :, 0]
    assert segments[20, 20] > 0
    assert len(np.unique(segments)) == 1 or -1 in segments


def test_a_python_without_a_wheel_is_told_which_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    monkeypatch.delitem(sys.modules, "frobs_sim_pybullet.bullet")
    monkeypatch.setattr(sys, "version_info", (3, 13, 0, "final", 0))
    with pytest.raises(ImportError, match=r"no wheel for Python 3\.13: use Python 3\.11"):
        import_module("frobs_sim_pybullet.bullet")


def test_a_contradictory_scene_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="kinematic"):
        simulate(tmp_path, "arm", scene=Scene(bodies={"x": Body(geometry=Sphere(0.1), mass=1.0, kinematic=True)}))
    with pytest.raises(ConfigurationError, match="names 'bal'"):
        simulate(tmp_path, "arm", scene=Scene(contacts={"c": Contact(first="bal")}))
    with pytest.raises(ConfigurationError, match="fixed to 'robot/hand'"):
        simulate(
            tmp_path, "arm", scene=Scene(cameras={"c": Camera(pos=(1, 0, 0), target=(0, 0, 0), frame="robot/hand")})
        )
