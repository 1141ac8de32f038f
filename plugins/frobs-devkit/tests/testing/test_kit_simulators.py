"""Faults in a simulator: MuJoCo with one thing broken."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.contracts import CommandMode
from frobs_core.description import Overlap
from frobs_core.models import Pose
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.errors import ConfigurationError, ModelFileError, SimulationError
from frobs_core.util.rotations import quat_conjugate, quat_multiply, quat_rotate
from frobs_devkit.testing import CheckFailure, Inconclusive, check_simulator, run_checks
from frobs_devkit.testing.simulator.under_test import TILTED
from frobs_sim_mujoco.body import MujocoBody
from frobs_sim_mujoco.looks import Looks
from frobs_sim_mujoco.meshes import Meshes
from frobs_sim_mujoco.robot import MujocoRobot
from frobs_sim_mujoco.simulation import MujocoSimulation
from frobs_sim_mujoco.wrenches import WrenchReader

Patch = Callable[[pytest.MonkeyPatch], None]
FAULTS: list[Any] = []
SEPARATE: list[Any] = []
"""Those that one check catches, and no other."""
INSEPARABLE = {
    "capabilities_are_known": "it reads the record, which is no method: test_a_capability_that_does_not_exist_fails",
    "abilities_are_declared": "it compares the record with the class: test_abilities_are_what_the_record_declares",
    "time_stands_between_steps": "what moves by itself shows wherever the state is read twice",
    **dict.fromkeys(
        (
            "paced_worlds_are_single",
            "steps_wait_for_the_world",
            "the_world_moves_on_by_itself",
            "missed_deadlines_are_reported",
            "resets_drive_home",
        ),
        "MuJoCo is not paced: the faults are in templates/my_paced_simulator.py, see tests/planted_faults",
    ),
    "undeclared_readings_refused": "MuJoCo declares both capabilities: test_readings_that_are_not_declared_are_refused",
    "spawning_is_seen": "the contract has no way yet to ask for it; it is always inconclusive",
}
"""Checks that no fault can be caught by alone, each with the reason."""


def wrong(owner: type, name: str, check: str, *, others: bool = False) -> Callable[[Callable[..., Any]], None]:
    """Note a method that is replaced by one that is given the original first.

    Args:
        owner: Class of the method or property.
        name: Of the method or property.
        check: That catches it.
        others: Whether other checks may catch it too.
    """

    def note(faulty: Callable[..., Any]) -> None:
        case = pytest.param(owner, name, check, faulty, id=f"{check}-{faulty.__name__}")
        FAULTS.append(case)
        if not others:
            SEPARATE.append(case)

    return note


def xyzw(quat: Any) -> Any:
    return np.roll(quat, -1, axis=-1)


@wrong(MujocoRobot, "frame_pose", "frames_are_current", others=True)
def quaternion_scalar_last(original: Any, self: Any, *args: Any, **kwargs: Any) -> Any:
    pos, quat = original(self, *args, **kwargs)
    return pos, xyzw(quat)


@wrong(MujocoSimulation, "step", "frames_are_current", others=True)
def frames_a_step_old(original: Any, self: Any, decimation: int) -> None:
    poses = {f: tuple(a.copy() for a in self.robots["robot"].frame_pose(f)) for f in ("tcp", "fore", "upper", "base")}
    original(self, decimation)
    pose = type(self.robots["robot"]).frame_pose
    self.robots["robot"].frame_pose = lambda f, q=None: poses[f] if q is None else pose(self.robots["robot"], f, q)


@wrong(MujocoRobot, "frame_pose", "given_joints_leave_the_state")
def given_joints_are_written(original: Any, self: Any, frame: str, joint_positions: Any = None) -> Any:
    if joint_positions is not None and len(joint_positions) == 1:
        self.write_joint_state(joint_positions)
    return original(self, frame, joint_positions)


@wrong(MujocoRobot, "frame_jacobian", "jacobian_is_the_derivative", others=True)
def angular_rows_first(original: Any, self: Any, frame: str) -> Any:
    return np.roll(original(self, frame), 3, axis=1)


@wrong(MujocoRobot, "frame_velocity", "frame_velocity_is_current", others=True)
def velocity_of_another_point(original: Any, self: Any, frame: str) -> Any:
    linear, angular = original(self, frame)
    return linear + np.cross(angular, [0.0, 0.0, 0.01]), angular


@wrong(MujocoRobot, "frame_velocity", "unknown_frames_refused")
def unknown_frame_is_the_tool(original: Any, self: Any, frame: str) -> Any:
    return original(self, "tcp" if frame == "no_such_link" else frame)


@wrong(MujocoRobot, "__init__", "joints_are_the_files")
def joints_sorted(original: Any, self: Any, *args: Any) -> None:
    original(self, *args)
    self.joint_names = tuple(sorted(self.joint_names))


@wrong(MujocoRobot, "__init__", "joints_are_the_files")
def effort_limit_ignored(original: Any, self: Any, *args: Any) -> None:
    original(self, *args)
    self.effort_limit = np.full_like(self.effort_limit, np.inf)


@wrong(MujocoRobot, "write_base_pose", "bases_are_placed", others=True)
def base_quaternion_scalar_last(original: Any, self: Any, pos: Any, quat: Any, mask: Any = None) -> None:
    original(self, pos, xyzw(quat), mask)


@wrong(MujocoRobot, "write_base_pose", "bases_are_placed")
def base_mask_ignored(original: Any, self: Any, pos: Any, quat: Any, mask: Any = None) -> None:
    original(self, pos, quat)


@wrong(MujocoRobot, "command", "drives_follow_positions", others=True)
def joints_swapped(original: Any, self: Any, values: Any) -> None:
    original(self, values[..., ::-1])


@wrong(MujocoRobot, "command", "drives_saturate", others=True)
def no_saturation(original: Any, self: Any, values: Any) -> None:
    self._simulation.model.actuator_forcerange[:] = 1e9
    self._simulation.model.actuator_forcelimited[:] = 0
    original(self, 0.5 * values)


@wrong(MujocoRobot, "command", "drives_follow_velocities")
def velocities_halved(original: Any, self: Any, values: Any) -> None:
    slow = set(self.command_modes) == {"velocity"} and self.robot.base == "fixed"
    original(self, 0.5 * values if slow else values)


@wrong(MujocoRobot, "joint_efforts", "drives_apply_efforts")
def efforts_not_read(original: Any, self: Any) -> Any:
    return original.fget(self) * (set(self.command_modes) != {"effort"})


@wrong(MujocoRobot, "command", "command_rows_are_steps")
def last_row_only(original: Any, self: Any, values: Any) -> None:
    original(self, values if values.ndim == 2 else np.repeat(values[:, -1:], values.shape[1], axis=1))


@wrong(MujocoRobot, "command", "commands_are_kept")
def command_read_late(original: Any, self: Any, values: Any) -> None:
    original(self, values)
    simulation, given = self._simulation, values.copy()
    step = type(simulation).step

    def read_again(decimation: int) -> None:
        if not np.array_equal(values, given):
            original(self, values)
        step(simulation, decimation)

    simulation.step = read_again


@wrong(MujocoRobot, "set_command_mode", "a_new_mode_holds")
def new_mode_goes_to_zero(original: Any, self: Any, mode: Any) -> None:
    original(self, mode)
    self.command(np.zeros((self.num_envs, self.dof)))


@wrong(MujocoSimulation, "time", "time_counts_steps", others=True)
def time_a_step_ahead(original: Any, self: Any) -> Any:
    return original.fget(self) * 1.1


@wrong(MujocoRobot, "write_joint_state", "joints_are_placed", others=True)
def velocities_not_written(original: Any, self: Any, positions: Any, velocities: Any = 0.0, mask: Any = None) -> None:
    original(self, positions, 0.0, mask)


@wrong(MujocoRobot, "write_joint_state", "joints_are_placed", others=True)
def joint_mask_ignored(original: Any, self: Any, positions: Any, velocities: Any = 0.0, mask: Any = None) -> None:
    original(self, positions, velocities)


@wrong(MujocoRobot, "base_twist", "floating_bases_fly")
def twist_swapped(original: Any, self: Any) -> Any:
    twist = original.fget(self)
    return twist[::-1] if self.robot.base == "floating" else twist


@wrong(MujocoRobot, "write_base_twist", "floating_bases_fly")
def twist_of_a_fixed_base(original: Any, self: Any, *args: Any) -> None:
    if self.robot.base != "fixed":
        original(self, *args)


@wrong(MujocoSimulation, "reset", "reset_honours_the_mask", others=True)
def resets_everything(original: Any, self: Any, mask: Any = None) -> None:
    original(self, None if mask is not None and mask.any() else mask)


@wrong(MujocoSimulation, "reset", "reset_honours_the_mask")
def resets_to_a_motion(original: Any, self: Any, mask: Any = None) -> None:
    original(self, mask)
    if mask is not None and mask.any():
        robot = self.robots["robot"]
        robot.write_joint_state(robot.joint_positions[mask].copy(), 1e-9, mask)


@wrong(MujocoSimulation, "snapshot", "snapshots_continue", others=True)
def velocities_lost(original: Any, self: Any) -> Any:
    robot = self.robots["robot"]
    moving = robot.joint_velocities.copy()
    robot.write_joint_state(robot.joint_positions.copy(), 0.0)
    snapshot = original(self)
    robot.write_joint_state(robot.joint_positions.copy(), moving)
    return {name: array.copy() for name, array in snapshot.items()}


@wrong(MujocoSimulation, "step", "motion_repeats", others=True)
def noise(original: Any, self: Any, decimation: int) -> None:
    robot = self.robots["robot"]
    robot.write_joint_state(robot.joint_positions + 1e-9 * np.random.uniform(), robot.joint_velocities.copy())  # noqa: NPY002
    original(self, decimation)


@wrong(MujocoRobot, "command", "rows_equal_singles")
def rows_mixed(original: Any, self: Any, values: Any) -> None:
    original(self, values + 1e-9 * (values.mean(0) - values))


@wrong(MujocoRobot, "joint_positions", "time_stands_between_steps", others=True)
def goes_on_by_itself(original: Any, self: Any) -> Any:
    self._simulation._batch_steps = getattr(self._simulation, "_batch_steps", 0) + 1
    return original.fget(self) + 1e-6 * self._simulation._batch_steps


@wrong(MujocoSimulation, "diverged", "divergence_is_contained")
def divergence_of_everything(original: Any, self: Any) -> Any:
    return None if original.fget(self) is None else np.ones(self.num_envs, np.bool_)


@wrong(MujocoSimulation, "close", "close_twice")
def close_raises(original: Any, self: Any) -> None:
    if getattr(self, "closed_once", False):
        raise RuntimeError("closed already")
    self.closed_once = True


@wrong(MujocoBody, "write_pose", "bodies_are_placed", others=True)
def body_mask_ignored(original: Any, self: Any, pos: Any, quat: Any = None, mask: Any = None) -> None:
    original(self, pos, quat)


@wrong(MujocoBody, "write_pose", "rays_measure", others=True)
def body_quaternion_scalar_last(original: Any, self: Any, pos: Any, quat: Any = None, mask: Any = None) -> None:
    original(self, pos, None if quat is None else xyzw(quat), mask)


@wrong(MujocoSimulation, "rays", "rays_measure")
def misses_are_zero(
    original: Any, self: Any, origins: Any, directions: Any, max_range: float, exclude: str = ""
) -> Any:
    found = original(self, origins, directions, max_range, exclude)
    return np.where(found >= max_range, 0.0, found)


@wrong(MujocoSimulation, "rays", "rays_exclude_a_robot")
def no_robot_excluded(
    original: Any, self: Any, origins: Any, directions: Any, max_range: float, exclude: str = ""
) -> Any:
    return original(self, origins, directions, max_range)


@wrong(MujocoRobot, "lidar", "lidars_measure")
def clockwise(original: Any, self: Any, name: str) -> Any:
    return original(self, name)[:, ::-1]


@wrong(MujocoSimulation, "contact", "contacts_are_told")
def contact_only_at_the_end(original: Any, self: Any, name: str) -> Any:
    return (
        original(self, name) & (self.bodies["ball"].pose[0][:, 2] < 0.06) if name == "landed" else original(self, name)
    )


@wrong(MujocoSimulation, "sensor_wrench", "weights_are_measured")
def torque_of_the_child_on_the_parent(original: Any, self: Any, robot: str, sensor: str) -> Any:
    return original(self, robot, sensor) * [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]


@wrong(WrenchReader, "read", "inertia_is_measured")
def explicit_accelerations(original: Any, self: Any, recorded: Any, qvel: Any) -> Any:
    velocities = np.concatenate([qvel[:, None], recorded["qvel"]], axis=1)
    return original(self, {**recorded, "qacc": np.diff(velocities, axis=1) / self._timestep}, qvel)


@wrong(MujocoSimulation, "snapshot", "pushes_are_measured")
def wrenches_not_in_the_snapshot(original: Any, self: Any) -> Any:
    return {name: array for name, array in original(self).items() if not name.startswith("wrench/")}


@wrong(MujocoSimulation, "apply_wrench", "wrenches_push", others=True)
def wrench_mask_ignored(original: Any, self: Any, body: str, force: Any, torque: Any, mask: Any = None) -> None:
    original(self, body, force, torque)


@wrong(MujocoSimulation, "apply_wrench", "wrenches_push")
def wrench_on_the_wrong_side(original: Any, self: Any, body: str, force: Any, torque: Any, mask: Any = None) -> None:
    original(self, body, force, -torque, mask)


@wrong(MujocoSimulation, "apply_wrench", "wrenches_add")
def wrench_replaces_the_last(original: Any, self: Any, body: str, force: Any, torque: Any, mask: Any = None) -> None:
    self._applied.pop(body, None)
    original(self, body, force, torque, mask)


@wrong(MujocoSimulation, "snapshot", "wrenches_add")
def applied_wrenches_not_in_the_snapshot(original: Any, self: Any) -> Any:
    return {name: array for name, array in original(self).items() if not name.startswith("applied_wrench/")}


@wrong(MujocoSimulation, "restore", "wrenches_add")
def applied_wrenches_outlive_a_restore(original: Any, self: Any, snapshot: Any) -> None:
    pending = dict(self._applied)
    original(self, snapshot)
    for body, wrench in pending.items():
        self._applied.add(body, wrench[:, :3], wrench[:, 3:])


@wrong(MujocoSimulation, "reset", "wrenches_add")
def applied_wrenches_outlive_a_reset(original: Any, self: Any, mask: Any = None) -> None:
    pending = dict(self._applied)
    self._applied = type(self._applied)(self.num_envs)
    original(self, mask)
    self._applied.update(pending)


@wrong(MujocoSimulation, "render", "cameras_see")
def depth_in_doubles(original: Any, self: Any, *args: Any, **kwargs: Any) -> Any:
    picture = original(self, *args, **kwargs)
    return picture.astype(np.float64) if picture.dtype == np.float32 else picture


def _ignores(name: str, check: str) -> None:
    def not_written(original: Any, self: Any, parameter: str, target: str, values: Any, mask: Any = None) -> None:
        kept = self.__dict__.setdefault("pretended", {})
        if parameter == name and (mask is None or name in Looks.names) and target not in ("no_such_body", "robot/tip"):
            kept[parameter, target] = values
        else:
            original(self, parameter, target, values, mask)

    wrong(MujocoSimulation, "write_parameter", check)(not_written)


for _name, _check in {
    "gravity": "gravity_shows",
    "mass": "mass_shows",
    "stiffness": "gains_show",
    "joint_damping": "joint_damping_shows",
    "friction": "friction_shows",
    "size": "sizes_show",
    "color": "colors_and_light_show",
    "light": "colors_and_light_show",
    "camera_position": "cameras_move",
    "camera_fov": "cameras_move",
    "texture": "scenery_shows",
    "distractors": "scenery_shows",
}.items():
    _ignores(_name, _check)


@wrong(MujocoSimulation, "write_parameter", "parameters_stay")
def parameter_mask_ignored(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    original(self, name, target, values, mask if name in Looks.names else None)


@wrong(MujocoSimulation, "write_parameter", "colors_and_light_show")
def light_is_shared(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    original(self, name, target, values, None if name == "light" else mask)


@wrong(MujocoSimulation, "write_parameter", "cameras_move")
def cameras_turn_the_other_way(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    original(self, name, target, -values if name == "camera_rotation" else values, mask)


@wrong(MujocoSimulation, "write_parameter", "inertia_follows_mass")
def inertia_of_what_was_before(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    if name != "mass" or target != "robot/fore":
        original(self, name, target, values, mask)
        return
    body = self.model.body(target).id
    share = np.asarray(values) / self.parameter(name, target)
    inertia = self.batch.expand("body_inertia")[:, body] * (0.5 + 0.5 * share)[:, None]
    original(self, name, target, values, mask)
    self.batch.expand("body_inertia")[:, body] = inertia


@wrong(MujocoSimulation, "write_parameter", "sizes_show")
def size_of_one_shape(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    geom = self.model.body(target).geomadr[0] if name == "size" else None
    original(self, name, target, values, mask)
    if geom is not None:
        self.batch.expand("geom_size")[:, geom] = self.model.geom_size[geom]


@wrong(MujocoSimulation, "write_parameter", "sizes_show")
def inertia_of_the_old_size(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    original(self, name, target, values, mask)
    if name == "size":
        self.batch.expand("body_inertia")[:] = self.model.body_inertia


@wrong(MujocoSimulation, "write_parameter", "sizes_show")
def size_multiplied(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    original(self, name, target, values * self.parameter(name, target) if name == "size" else values, mask)


@wrong(MujocoRobot, "write_gains", "drives_hold_as_gains_change")
def target_scaled_by_gains(original: Any, self: Any, which: int, rows: Any, values: Any) -> None:
    controls = self._batch.bind("ctrl").copy()
    original(self, which, rows, values)
    self._batch.bind("ctrl")[:] = controls


@wrong(MujocoRobot, "base_twist", "wheels_roll")
def wheels_slip(original: Any, self: Any) -> Any:
    linear, angular = original.fget(self)
    return (0.5 if self.robot.base == "wheeled" else 1.0) * linear, angular


@wrong(MujocoSimulation, "overlaps", "overlaps_are_told")
def neighbours_overlap(original: Any, self: Any, robot: str = "robot") -> Any:
    return [*original(self, robot), Overlap(first="a", second="b", depth=0.01)]


@wrong(MujocoSimulation, "render", "depth_is_in_metres")
def depth_as_inverse(original: Any, self: Any, *args: Any, **kwargs: Any) -> Any:
    picture = original(self, *args, **kwargs)
    return 1.0 / picture if picture.dtype == np.float32 else picture


@wrong(Meshes, "hull", "broken_meshes_are_refused")
def broken_mesh_is_none(original: Any, self: Any, mesh: Any) -> Any:
    try:
        return original(self, mesh)
    except ModelFileError:
        return []


@wrong(MujocoRobot, "write_joint_state", "mimics_follow")
def followers_stay(original: Any, self: Any, positions: Any, velocities: Any = 0.0, mask: Any = None) -> None:
    before = self._batch.bind("qpos").copy()
    original(self, positions, velocities, mask)
    if self.dof == 1:
        self._batch.bind("qpos")[:, 1:] = before[:, 1:]


@wrong(MujocoSimulation, "time", "arrays_have_their_shapes")
def single_precision(original: Any, self: Any) -> Any:
    found = original.fget(self)
    return found.astype(np.float32) if self.scene.floor else found


@wrong(MujocoRobot, "write_joint_state", "writes_broadcast")
def mask_in_reverse(original: Any, self: Any, positions: Any, velocities: Any = 0.0, mask: Any = None) -> None:
    several = mask is not None and np.ndim(positions) == 2 and len(positions) > 1
    original(self, positions[::-1] if several else positions, velocities, mask)


@wrong(MujocoSimulation, "reset", "rows_of_a_single")
def an_empty_mask_is_everybody(original: Any, self: Any, mask: Any = None) -> None:
    original(self, None if mask is not None and not mask.any() else mask)


@wrong(MujocoSimulation, "__init__", "robots_stand_apart")
def robots_in_one_place(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    first = next(iter(robots.values())).pose
    placed = {name: one if name in scene.props else replace(one, pose=first) for name, one in robots.items()}
    original(self, placed, scene, **keywords)


@wrong(MujocoBody, "write_pose", "static_bodies_stay")
def static_bodies_are_silent(original: Any, self: Any, *args: Any, **kwargs: Any) -> None:
    with suppress(SimulationError):
        original(self, *args, **kwargs)


@wrong(MujocoSimulation, "contact_force", "unknown_targets_refused")
def unknown_contacts_have_no_force(original: Any, self: Any, name: str) -> Any:
    return np.zeros(self.num_envs) if name == "no_such_contact" else original(self, name)


@wrong(MujocoSimulation, "contact", "contacts_of_robots_are_told")
def links_are_not_told_apart(original: Any, self: Any, name: str) -> Any:
    return original(self, "robot") if name == "pair" else original(self, name)


@wrong(MujocoSimulation, "contact", "contacts_can_ignore")
def nothing_is_ignored(original: Any, self: Any, name: str) -> Any:
    told = original(self, name)
    return self.contact("except the floor") if name == "except floor and kerb" else told


@wrong(MujocoSimulation, "reset", "contacts_end_with_a_reset")
def contacts_outlive_a_reset(original: Any, self: Any, mask: Any = None) -> None:
    told = self.contacts.snapshot()
    original(self, mask)
    self.contacts.restore(told)


@wrong(MujocoSimulation, "contact_resultant", "resultants_are_forces_on_the_first_side")
def forces_on_the_other_side(original: Any, self: Any, name: str) -> Any:
    return -original(self, name)


@wrong(MujocoSimulation, "contact_resultant", "resultants_are_forces_on_the_first_side")
def resultants_without_friction(original: Any, self: Any, name: str) -> Any:
    return original(self, name) * [0.0, 0.0, 1.0]


@wrong(MujocoSimulation, "contact_resultant", "resultants_are_forces_on_the_first_side")
def resultants_of_one_corner(original: Any, self: Any, name: str) -> Any:
    return original(self, name) / 4.0


@wrong(MujocoSimulation, "step_with", "contacts_are_those_of_all_steps")
def contacts_are_those_of_the_last_step(original: Any, self: Any, decimation: int, update: Any) -> None:
    pushed = {body: wrench.copy() for body, wrench in self._applied.items()}  # during all steps
    for number in range(decimation):
        if number:
            update()
            self._applied.update({body: wrench.copy() for body, wrench in pushed.items()})
        self.step(1)


@wrong(MujocoRobot, "frame_velocity", "frames_of_floating_bases_move")
def twist_of_the_base_forgotten(original: Any, self: Any, frame: str) -> Any:
    if self.robot.base != "floating" or frame == "base":
        return original(self, frame)
    moved = (self.frame_jacobian(frame) * self.joint_velocities[:, None, :]).sum(-1)
    return moved[:, :3], moved[:, 3:]


@wrong(MujocoSimulation, "restore", "snapshots_hold_all")
def held_command_lost(original: Any, self: Any, snapshot: Any) -> None:
    original(self, snapshot)
    robot = self.robots["robot"]
    robot.command(np.zeros((self.num_envs, robot.dof)))


@wrong(MujocoRobot, "frame_pose", "frames_are_current")
def forearm_elsewhere(original: Any, self: Any, frame: str, joint_positions: Any = None) -> Any:
    pos, quat = original(self, frame, joint_positions)
    return (pos, xyzw(quat)) if frame == "fore" and joint_positions is None else (pos, quat)


@wrong(MujocoRobot, "frame_jacobian", "jacobian_is_the_derivative")
def upper_arm_turns_the_other_way(original: Any, self: Any, frame: str) -> Any:
    return original(self, frame) * (np.array([1, 1, 1, -1, -1, -1])[:, None] if frame == "upper" else 1.0)


@wrong(MujocoRobot, "frame_velocity", "frame_velocity_is_current")
def forearm_twice_as_fast(original: Any, self: Any, frame: str) -> Any:
    linear, angular = original(self, frame)
    return (2.0 * linear, angular) if frame == "fore" else (linear, angular)


@wrong(MujocoRobot, "command", "drives_follow_positions")
def small_commands_are_off(original: Any, self: Any, values: Any) -> None:
    weightless = not self._simulation.parameter("gravity").any()
    small = set(self.command_modes) == {"position"} and self.dof == 2 and not weightless and np.abs(values).max() < 0.5
    alone = small and self.joint_names == ("lift", "turn") and values.ndim == 2
    original(self, values + 1e-6 if alone and values[0, 1] == 0.4 else values)


@wrong(MujocoRobot, "command", "drives_saturate")
def large_commands_are_clipped(original: Any, self: Any, values: Any) -> None:
    far = set(self.command_modes) == {"position"} and self.joint_names == ("lift", "turn")
    original(self, np.minimum(values, [0.35, 2.5]) if far else values)


@wrong(MujocoSimulation, "time", "time_counts_steps")
def time_of_the_last_call(original: Any, self: Any) -> Any:
    return np.minimum(original.fget(self), 0.018) if original.fget(self).max() < 0.0205 else original.fget(self)


@wrong(MujocoRobot, "write_joint_state", "joints_are_placed")
def velocities_stay_under_a_mask(
    original: Any, self: Any, positions: Any, velocities: Any = 0.0, mask: Any = None
) -> None:
    keeps = mask is not None and np.ndim(velocities) == 0
    original(self, positions, self.joint_velocities[mask].copy() if keeps else velocities, mask)


@wrong(MujocoSimulation, "restore", "snapshots_continue")
def bodies_come_to_rest(original: Any, self: Any, snapshot: Any) -> None:
    original(self, snapshot)
    for body in self.bodies.values():
        body.write_pose(*(array.copy() for array in body.pose))


@wrong(MujocoSimulation, "__init__", "motion_repeats")
def threads_matter(original: Any, self: Any, robots: Any, scene: Any, *, num_threads: int = 0, **keywords: Any) -> None:
    heavier = replace(scene, gravity=(0.0, 0.0, -9.8100001)) if num_threads == 2 else scene
    original(self, robots, heavier, num_threads=num_threads, **keywords)


@wrong(MujocoBody, "write_pose", "bodies_are_placed")
def body_turns_back(original: Any, self: Any, pos: Any, quat: Any = None, mask: Any = None) -> None:
    original(self, pos, np.array([[1.0, 0.0, 0.0, 0.0]]) if quat is None else quat, mask)


@wrong(MujocoSimulation, "render", "pictures_are_true")
def upside_down(original: Any, self: Any, *args: Any, **kwargs: Any) -> Any:
    return original(self, *args, **kwargs)[:, ::-1]


@wrong(MujocoSimulation, "__init__", "intrinsics_project_points")
def intrinsics_are_ignored(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    cameras = {name: replace(camera, intrinsics=None) for name, camera in scene.cameras.items()}
    original(self, robots, replace(scene, cameras=cameras), **keywords)


@wrong(MujocoSimulation, "render", "fast_pictures_show_the_same")
def fast_pictures_are_black(original: Any, self: Any, *args: Any, fast: bool = False, **kwargs: Any) -> Any:
    return original(self, *args, fast=fast, **kwargs) * np.uint8(not fast)


@wrong(MujocoSimulation, "render", "fast_pictures_show_the_same")
def fast_pictures_show_one_environment(original: Any, self: Any, *args: Any, fast: bool = False, **kwargs: Any) -> Any:
    drawn = original(self, *args, fast=fast, **kwargs)
    return np.repeat(drawn[:1], len(drawn), axis=0) if fast else drawn


@wrong(MujocoSimulation, "render", "fast_pictures_show_the_same")
def fast_pictures_have_one_size(original: Any, self: Any, *args: Any, fast: bool = False, **kwargs: Any) -> Any:
    drawn = original(self, *args, fast=fast, **kwargs)
    return np.resize(drawn, (len(drawn), 84, 84, 3)) if fast else drawn


@wrong(MujocoSimulation, "translation", "elements_are_accounted_for")
def an_element_is_not_told(original: Any, cls: Any, model: Any) -> Any:
    return original(cls, model)[1:]


@wrong(MujocoSimulation, "write_parameter", "frames_without_mass_refused")
def a_mass_for_nothing(original: Any, self: Any, name: str, target: str, values: Any, mask: Any = None) -> None:
    if target != "robot/tip":
        original(self, name, target, values, mask)


@wrong(MujocoSimulation, "__init__", "contradictions_are_refused")
def contacts_of_nobody_are_dropped(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    known = {name: contact for name, contact in scene.contacts.items() if contact.first != "no_such_body"}
    original(self, robots, replace(scene, contacts=known), **keywords)


@wrong(MujocoSimulation, "step", "overlapping_links_let_each_other_be")
def overlapping_links_push(original: Any, self: Any, decimation: int) -> None:
    original(self, decimation)
    robot = self.robots["robot"]
    if robot.model.name == "kit_pile":
        robot.write_joint_state(robot.joint_positions + 1e-2)


@wrong(MujocoBody, "write_twist", "bodies_are_thrown")
def twists_are_written_everywhere(original: Any, self: Any, linear: Any, angular: Any, mask: Any = None) -> None:
    original(self, linear, angular)


@wrong(MujocoBody, "start", "bodies_are_thrown", others=True)
def bodies_start_at_rest(original: Any, self: Any) -> None:
    pass


@wrong(MujocoBody, "write_twist", "bodies_are_thrown", others=True)
def angular_velocity_in_the_body_frame(original: Any, self: Any, linear: Any, angular: Any, mask: Any = None) -> None:
    original(self, linear, quat_rotate(self.pose[1][0], np.asarray(angular)), mask)


@wrong(MujocoBody, "twist", "compound_bodies_move")
def twist_of_the_center_of_mass(original: Any, self: Any) -> Any:
    linear, angular = original.fget(self)
    return linear + np.cross(angular, self._simulation.derived("xipos")[:, self._id] - self.pose[0]), angular


def change_bodies(original: Any, self: Any, robots: Any, scene: Any, keywords: Any, change: Callable[..., Any]) -> None:
    bodies = {name: change(name, body) for name, body in scene.bodies.items()}
    original(self, robots, replace(scene, bodies=bodies), **keywords)


@wrong(MujocoSimulation, "__init__", "compound_bodies_move")
def products_of_inertia_ignored(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    def straighten(name: str, body: Any) -> Any:
        if name != "hammer" or scene.attachments:
            return body
        ixx, _, _, iyy, _, izz = body.inertial.inertia
        return replace(body, inertia=(ixx, 0.0, 0.0, iyy, 0.0, izz))

    change_bodies(original, self, robots, scene, keywords, straighten)


@wrong(MujocoSimulation, "__init__", "every_shape_is_met")
def only_the_first_shape(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    def strip(name: str, body: Any) -> Any:
        return replace(body, shapes=body.shapes[:1]) if name == "pile" else body

    change_bodies(original, self, robots, scene, keywords, strip)


@wrong(MujocoSimulation, "__init__", "every_shape_is_met")
def drawn_shapes_collide(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    def fill(name: str, body: Any) -> Any:
        return replace(body, shapes=tuple(replace(shape, collides=True) for shape in body.shapes))

    change_bodies(original, self, robots, scene, keywords, fill)


@wrong(MujocoSimulation, "__init__", "frictions_brake")
def no_torsional_friction(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    change_bodies(original, self, robots, scene, keywords, lambda _, body: replace(body, torsional_friction=0.0))


@wrong(MujocoSimulation, "__init__", "frictions_brake")
def rolling_friction_tenfold(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    def brake(name: str, body: Any) -> Any:
        return replace(body, rolling_friction=10.0 * body.rolling_friction)

    change_bodies(original, self, robots, scene, keywords, brake)


@wrong(MujocoSimulation, "__init__", "attachments_hold")
def nothing_is_attached(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    original(self, robots, replace(scene, attachments={}), **keywords)


@wrong(MujocoSimulation, "__init__", "attachments_hold")
def given_poses_are_ignored(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    moved = {name: replace(one, pose=one.pose and Pose((0.3, 0.0, 0.1))) for name, one in scene.attachments.items()}
    original(self, robots, replace(scene, attachments=moved), **keywords)


@wrong(MujocoSimulation, "__init__", "bodies_fall_and_spin")
def physics_timestep_is_the_usual(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    original(self, robots, scene, **{**keywords, "physics_timestep": 0.002})


@wrong(MujocoBody, "pose", "bodies_fall_and_spin", others=True)
def bodies_spin_in_their_own_frame(original: Any, self: Any) -> Any:
    pos, quat = original.fget(self)
    start = np.broadcast_to(np.array(TILTED.quat_wxyz), quat.shape)
    return pos, quat_multiply(start, quat_multiply(quat, quat_conjugate(start)))


@wrong(MujocoSimulation, "__init__", "plates_precess")
def every_body_is_a_ball(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    def round(name: str, body: Any) -> Any:
        return replace(body, inertia=(0.01, 0.0, 0.0, 0.01, 0.0, 0.01)) if name == "plate" else body

    change_bodies(original, self, robots, scene, keywords, round)


def change_joints(original: Any, self: Any, robots: Any, scene: Any, keywords: Any, **factors: float) -> None:
    changed = {}
    for name, placed in robots.items():
        joints = [
            replace(joint, **{field: factor * getattr(joint, field) for field, factor in factors.items()})
            for joint in placed.model.joints
        ]
        same = name in scene.props
        changed[name] = placed if same else replace(placed, model=replace(placed.model, joints=tuple(joints)))
    original(self, changed, scene, **keywords)


@wrong(MujocoSimulation, "__init__", "joints_coast")
def joint_damping_twice(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    change_joints(original, self, robots, scene, keywords, damping=2.0)


@wrong(MujocoSimulation, "__init__", "joints_coast")
def joint_friction_ignored(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    change_joints(original, self, robots, scene, keywords, friction=0.0)


def change_robots(original: Any, self: Any, robots: Any, scene: Any, keywords: Any, **fields: Any) -> None:
    changed = {name: replace(placed, robot=replace(placed.robot, **fields)) for name, placed in robots.items()}
    original(self, changed, scene, **keywords)


@wrong(MujocoSimulation, "__init__", "armatures_resist")
def motors_without_inertia(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    change_robots(original, self, robots, scene, keywords, armature={})


@wrong(MujocoSimulation, "__init__", "links_collide")
def links_always_collide(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    change_robots(original, self, robots, scene, keywords, self_collision=True)


@wrong(MujocoSimulation, "__init__", "links_collide", others=True)
def links_never_collide(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    change_robots(original, self, robots, scene, keywords, self_collision=False)


@wrong(MujocoSimulation, "__init__", "boxes_slide")
def friction_of_the_scene_ignored(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    def rough(name: str, body: Any) -> Any:
        return replace(body, friction=1.0) if body.twist[0] == (1.0, 0.0, 0.0) else body

    change_bodies(original, self, robots, scene, keywords, rough)


@wrong(MujocoSimulation, "step_with", "updates_come_between_steps")
def updates_after_the_last_step(original: Any, self: Any, decimation: int, update: Any) -> None:
    original(self, decimation, update)
    update()


@wrong(MujocoSimulation, "write_body_poses", "bodies_are_placed")
def mask_of_several_bodies_ignored(
    original: Any, self: Any, names: Any, pos: Any, quat_wxyz: Any = None, mask: Any = None
) -> None:
    original(self, names, pos, quat_wxyz)


@wrong(MujocoRobot, "joint_efforts", "drives_saturate", others=True)
def efforts_are_read_before_they_saturate(original: Any, self: Any) -> Any:
    efforts = original.fget(self)
    return np.where(np.isclose(np.abs(efforts), self.effort_limit), 1.1 * efforts, efforts)


@wrong(MujocoRobot, "frame_pose", "given_joints_leave_the_state")
def given_joints_are_seen_from_the_moved_base(original: Any, self: Any, frame: str, joint_positions: Any = None) -> Any:
    pos, quat = original(self, frame, joint_positions)
    if joint_positions is None:
        return pos, quat
    return pos + self.base_pose[0][0] - np.array(self._start.pos), quat


@wrong(MujocoRobot, "joint_efforts", "joints_carry_their_weight")
def efforts_of_an_arm_are_small(original: Any, self: Any) -> Any:
    return original.fget(self) * (0.9 if self.model.name == "kit_arm" else 1.0)


@wrong(MujocoSimulation, "_build_model", "limits_stop_joints")
def no_joint_is_limited(original: Any, self: Any, **keywords: Any) -> Any:
    model = original(self, **keywords)
    if self._placements["robot"].model.name == "kit_arm":
        model.jnt_limited[:] = 0
    return model


@wrong(MujocoRobot, "set_command_mode", "command_modes_mix")
def the_first_mode_for_all(original: Any, self: Any, mode: Any) -> None:
    original(self, mode if isinstance(mode, CommandMode) else mode[0])


@wrong(MujocoSimulation, "apply_wrench", "props_give_way")
def props_are_not_pushed(original: Any, self: Any, body: str, force: Any, torque: Any, mask: Any = None) -> None:
    if not body.startswith("drawer/"):
        original(self, body, force, torque, mask)


@wrong(MujocoSimulation, "__init__", "props_give_way")
def props_stand_unturned(original: Any, self: Any, robots: Any, scene: Any, **keywords: Any) -> None:
    straight = {name: replace(robots[name], pose=Pose(robots[name].pose.pos)) for name in scene.props}
    original(self, {**robots, **straight}, scene, **keywords)


def plant(monkeypatch: pytest.MonkeyPatch, owner: type, name: str, faulty: Callable[..., Any]) -> None:
    original = inspect.getattr_static(owner, name)
    if isinstance(original, classmethod):
        of_class = original.__func__
        monkeypatch.setattr(owner, name, classmethod(lambda cls, *args: faulty(of_class, cls, *args)))
        return

    def replaced(self: Any, *args: Any, **kwargs: Any) -> Any:
        return faulty(original, self, *args, **kwargs)

    monkeypatch.setattr(owner, name, property(replaced) if isinstance(original, property) else replaced)


@pytest.mark.parametrize(("owner", "name", "check", "faulty"), FAULTS)
def test_the_kit_catches(
    monkeypatch: pytest.MonkeyPatch, owner: type, name: str, check: str, faulty: Callable[..., Any]
) -> None:
    plant(monkeypatch, owner, name, faulty)
    found = next(c for c in check_simulator("mujoco") if c.name == check)
    try:
        found.run()
    except CheckFailure:
        return
    except Inconclusive as reason:
        if "cannot render" in str(reason):
            pytest.skip(f"not applicable: {reason}")
        raise
    pytest.fail("not caught")


@pytest.mark.slow
@pytest.mark.parametrize(("owner", "name", "check", "faulty"), SEPARATE)
def test_no_other_check_catches(
    monkeypatch: pytest.MonkeyPatch, owner: type, name: str, check: str, faulty: Callable[..., Any]
) -> None:
    plant(monkeypatch, owner, name, faulty)
    drawing = (
        "cameras_see",
        "pictures_are_true",
        "fast_pictures_show_the_same",
        "depth_is_in_metres",
    )  # seconds each; no fault but those of render reaches them
    found = [one for one in check_simulator("mujoco") if name == "render" or one.name not in drawing]
    report = run_checks(found)
    if check in [result.name for result in report.inconclusive]:
        pytest.skip("not applicable: nothing can be drawn here")
    assert [result.name for result in report.failed] == [check]


def test_every_check_has_a_fault_that_no_other_catches() -> None:
    caught = {case.values[2] for case in SEPARATE}
    assert not caught & INSEPARABLE.keys()
    assert caught | INSEPARABLE.keys() == {check.name for check in check_simulator("mujoco")}


def record(**capabilities: Any) -> SimulatorRecord:
    return SimulatorRecord(
        name="mine", summary="", entry_point="frobs_sim_mujoco.simulation:MujocoSimulation", capabilities=capabilities
    )


def test_a_capability_that_does_not_exist_fails() -> None:
    with pytest.raises(CheckFailure, match="'teleportation' is not a capability"):
        check_simulator(record(teleportation=Level.EXACT))[0].run()


def test_abilities_are_what_the_record_declares(monkeypatch: pytest.MonkeyPatch) -> None:
    levels = plugins.get_record("simulator", "mujoco").capabilities

    def check(**changed: Level) -> None:
        found = check_simulator(record(**{**levels, **changed}))
        next(c for c in found if c.name == "abilities_are_declared").run()

    check()
    with pytest.raises(CheckFailure, match="defines rays, but the record does not declare 'rays'"):
        check(rays=Level.UNSUPPORTED)
    monkeypatch.delattr(MujocoSimulation, "render")
    with pytest.raises(CheckFailure, match="declares 'cameras', but MujocoSimulation does not define render"):
        check()


@pytest.mark.parametrize(
    ("check", "says"),
    [
        ("paced_worlds_are_single", "'pacer' is None"),
        ("steps_wait_for_the_world", r"steps of 0\.4 s returned after"),
        ("the_world_moves_on_by_itself", r"in 0\.3 s between two steps"),
        ("missed_deadlines_are_reported", "'pacer' is None"),
        ("resets_drive_home", r"the joints need at least 0\.\d+ s"),
    ],
)
def test_a_claim_of_real_time_is_checked(check: str, says: str) -> None:
    (found,) = (c for c in check_simulator(record(real_time=Level.EXACT)) if c.name == check)
    with pytest.raises(CheckFailure, match=says):
        found.run()


def test_a_paced_world_is_single_and_does_not_pause() -> None:
    (found,) = (
        c
        for c in check_simulator(record(real_time=Level.EXACT, pause=Level.EXACT))
        if c.name == "paced_worlds_are_single"
    )
    with pytest.raises(CheckFailure, match="claims both 'real_time' and 'pause'"):
        found.run()


@pytest.mark.parametrize("capability", ["force_torque", "contacts"])
def test_readings_that_are_not_declared_are_refused(capability: str) -> None:
    levels = plugins.get_record("simulator", "mujoco").capabilities
    checks = check_simulator(record(**{**levels, capability: Level.UNSUPPORTED}))
    with pytest.raises(CheckFailure, match=f"of a simulator without '{capability}'"):
        next(c for c in checks if c.name == "undeclared_readings_refused").run()


class OnlyJoints(MujocoSimulation):
    """A simulator of fixed arms: neither bodies nor bases move freely."""

    def __init__(self, robots: Any, scene: Any, **keywords: Any) -> None:
        scene.check(robots, lacking=("bodies",))
        for name, placement in robots.items():
            if placement.robot.base != "fixed":
                raise ConfigurationError(f"robot '{name}' has a {placement.robot.base} base, which is not supported.")
        super().__init__(robots, scene, **keywords)


@pytest.mark.slow
def test_a_simulator_needs_neither_free_bodies_nor_moving_bases() -> None:
    names = ("determinism", "snapshot", "teleport", "pause", "batched", "drive")
    only = SimulatorRecord(
        name="only_joints",
        summary="",
        entry_point=f"{__name__}:OnlyJoints",
        capabilities=dict.fromkeys(names, Level.EXACT),
    )
    results = {result.name: result for result in run_checks(check_simulator(only)).results}
    odd = {name: result.message for name, result in results.items() if result.status in ("failed", "skipped")}
    # MuJoCo implements more than this record declares
    assert odd.keys() == {"abilities_are_declared", "undeclared_readings_refused"}
    assert results["rows_equal_singles"].status == results["reset_honours_the_mask"].status == "passed"
    for name in ("bodies_are_placed", "bodies_fall_and_spin", "floating_bases_fly"):
        assert results[name].status == "not_applicable"
        assert "not support" in results[name].message


def test_what_is_not_claimed_is_not_checked() -> None:
    checks = [check for check in check_simulator(record(drive=Level.EXACT)) if check.capability]
    status = {result.name: result.status for result in run_checks(checks).results}
    assert status["rays_measure"] == "not_applicable"
    assert status["drives_follow_positions"] == "passed"


def test_one_environment_at_a_time_is_enough_without_batched() -> None:
    claims = dict.fromkeys(
        ("drive", "teleport", "rays", "contacts", "wrench", "snapshot", "randomize_friction"), Level.EXACT
    )
    of_the_record = ("abilities_are_declared", "undeclared_readings_refused")
    checks = [check for check in check_simulator(record(**claims)) if check.name not in of_the_record]
    for result in run_checks(checks).results:
        assert result.status in ("passed", "not_applicable"), result
