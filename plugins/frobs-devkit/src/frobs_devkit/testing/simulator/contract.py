"""Checks of the formal simulation contract: shapes, dtypes, read-only arrays and rejected names."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.description import Contact, Placement, Scene
from frobs_core.models import Pose
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import Level
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import FrobsError, SimulationError, UnknownNameError
from frobs_devkit.testing.checks import NotApplicable, expect, expect_raises
from frobs_devkit.testing.compare import expect_array, expect_close, expect_rows, expect_same
from frobs_devkit.testing.simulator.robots import ARM, LIFT, model_of
from frobs_devkit.testing.simulator.stepping import FLOATING
from frobs_devkit.testing.simulator.under_test import (
    BALL,
    TIMESTEP,
    WALL,
    WEIGHTLESS,
    SimulatorUnderTest,
    spread,
    verifies,
)


def capabilities_are_known(subject: SimulatorUnderTest) -> None:
    """The record contains only known capabilities with levels, and its entry point is a subclass of Simulation."""
    for name, level in subject.record.capabilities.items():
        expect(
            name in known_capabilities(), f"'{name}' is not a capability; available: {', '.join(known_capabilities())}."
        )
        expect(isinstance(level, Level), f"the level of the capability '{name}' is {level!r}; expected a Level.")
    cls = subject.record.load()
    expect(isinstance(cls, type) and issubclass(cls, Simulation), f"{cls} is not a subclass of Simulation.")


def abilities_are_declared(subject: SimulatorUnderTest) -> None:
    """Every declared capability is implemented, and every implemented capability is declared."""
    cls, levels = subject.record.load(), subject.record.capabilities
    for name, capability in known_capabilities().items():
        defined = [
            method
            for method in capability.methods
            if getattr(cls, method, None) is not getattr(Simulation, method, None)
        ]
        if levels.get(name, Level.UNSUPPORTED):
            missing = [method for method in capability.methods if method not in defined]
            expect(
                not missing, f"the record declares '{name}', but {cls.__name__} does not define {', '.join(missing)}."
            )
        else:
            expect(
                not defined, f"{cls.__name__} defines {', '.join(defined)}, but the record does not declare '{name}'."
            )


def arrays_have_their_shapes(subject: SimulatorUnderTest) -> None:
    """Arrays are float64 of shape (num_envs, …), contacts are bool, and changing a returned array has no effect."""
    contacts = {"ball": Contact(first="ball")} if subject.level("contacts") and subject.free_bodies else {}
    with subject.build(bodies=subject.free_bodies, contacts=contacts, num_threads=1) as (sim, robot):
        n, dof = sim.num_envs, robot.dof
        robot.command(robot.home + 0.2)
        sim.step(3)
        expect(robot.num_envs == n, f"the robot's num_envs is {robot.num_envs}; expected {n}.")
        expect(sim.physics_timestep == TIMESTEP, f"physics_timestep is {sim.physics_timestep}, not {TIMESTEP}.")
        expect(robot.name == "robot", f"the robot's name is '{robot.name}'; expected 'robot'.")
        arrays: dict[str, tuple[Any, tuple[int, ...]]] = {
            name: (getattr(robot, name), (n, dof))
            for name in ("home", "position_lower", "position_upper", "velocity_limit", "effort_limit")
        }
        arrays |= {f"drive_gains()[{i}]": (gain, (n, dof)) for i, gain in enumerate(robot.drive_gains())}
        arrays |= {"frame_jacobian('tcp')": (robot.frame_jacobian("tcp"), (n, 6, dof)), "time": (sim.time, (n,))}
        for name, (array, shape) in arrays.items():
            expect_array(array, shape, np.float64, name)
        for name, read, shape in _readings(sim, robot):
            before = read().copy()
            expect_array(read(), shape, np.float64, name)
            if read().flags.writeable:
                read()[...] = 7.5
                expect_same(before, read(), f"{name} after writing to the returned array")
        for name in contacts:
            expect_array(sim.contact(name), (n,), np.bool_, f"contact('{name}')")
            expect_array(sim.contact_force(name), (n,), np.float64, f"contact_force('{name}')")


@verifies("teleport")
def writes_broadcast(subject: SimulatorUnderTest) -> None:
    """Written values have one row for each selected environment, in order, or a single row for all environments."""
    with subject.build(bodies=subject.free_bodies, num_threads=1) as (sim, robot):
        n = sim.num_envs
        robot.write_joint_state(np.array([0.2, -0.3]), np.array([[0.1, 0.4]]))
        subject.expect_each([0.2, -0.3], robot.joint_positions, 1e-12, "joint_positions after a single row was written")
        subject.expect_each(
            [0.1, 0.4], robot.joint_velocities, 1e-12, "joint_velocities after a single row was written"
        )
        if n < 3:
            return
        mask = np.arange(n) != 1
        rows = spread(-1, 1, (n - 1, 2))
        robot.write_joint_state(rows, 0.0, mask)
        expect_close(rows, robot.joint_positions[mask], 1e-12, "joint_positions written to environments 0 and 2")
        if not sim.bodies:
            return
        places = spread(1, 2, (n - 1, 3))
        sim.bodies["ball"].write_pose(places, mask=mask)
        expect_close(places, sim.bodies["ball"].pose[0][mask], 1e-9, "the ball's positions in environments 0 and 2 [m]")


def robots_stand_apart(subject: SimulatorUnderTest) -> None:
    """In a scene with two robots, each robot has its own handle and pose, and follows its own commands."""
    placements = {
        "robot": Placement(robot=ARM, model=model_of("kit_arm"), command_mode=CommandMode.POSITION),
        "other": Placement(
            robot=LIFT, model=model_of("kit_lift"), pose=Pose(pos=(3.0, 1.0, 0.0)), command_mode=CommandMode.POSITION
        ),
    }
    sim: Simulation = subject.record.load()(
        placements, Scene(gravity=WEIGHTLESS), num_envs=subject.num_envs, physics_timestep=TIMESTEP, num_threads=1
    )
    with closing(sim):
        sim.reset()
        expect(set(sim.robots) == set(placements), f"robots is {sorted(sim.robots)}, not {sorted(placements)}.")
        n, arm, lift = sim.num_envs, sim.robots["robot"], sim.robots["other"]
        subject.expect_each([3.0, 1.0, 0.0], lift.base_pose[0], 1e-9, "base_pose of the second robot [m]")
        target = np.tile([0.1, 0.5], (n, 1))
        lift.command(target)
        sim.step(1500)
        expect_close(target, lift.joint_positions, 2e-3, "joint_positions of the second robot, which follows a command")
        expect_close(
            arm.home, arm.joint_positions, 2e-3, "joint_positions of the first robot, which holds its position"
        )


@verifies("teleport")
def static_bodies_stay(subject: SimulatorUnderTest) -> None:
    """Static bodies reject new poses, and bodies that do not collide fall through the floor."""
    ghost = type(BALL)(geometry=BALL.geometry, pose=Pose(pos=(0.0, 2.0, 0.1)), mass=0.5, collides=False)
    with subject.build(bodies={"wall": WALL, "ghost": ghost}, num_threads=1) as (sim, _):
        sim.step(150)
        expect(
            (sim.bodies["ghost"].pose[0][:, 2] < -0.1).all(),
            "the floor stops a body with collides=False, which must fall through the floor.",
        )
        with expect_raises(SimulationError, "write_pose on a static body"):
            sim.bodies["wall"].write_pose(np.zeros((sim.num_envs, 3)))


def unknown_targets_refused(subject: SimulatorUnderTest) -> None:
    """Unknown bodies, contacts and targets raise UnknownNameError, and too many command rows raise an error."""
    with subject.build(bodies=subject.free_bodies, num_threads=1) as (sim, robot):
        n = sim.num_envs
        if subject.level("contacts"):
            with expect_raises(UnknownNameError, "contact_force('no_such_contact')"):
                sim.contact_force("no_such_contact")
        if subject.level("wrench"):
            with expect_raises(UnknownNameError, "apply_wrench('no_such_body', …)"):
                sim.apply_wrench("no_such_body", np.zeros((n, 3)), np.zeros((n, 3)))
        if subject.level("randomize_mass"):
            with expect_raises(UnknownNameError, "write_parameter('mass', 'no_such_body', …)"):
                sim.write_parameter("mass", "no_such_body", np.ones(n))
        with expect_raises(FrobsError, "a command with 5 rows in a step of 3 physics steps"):
            robot.command(np.zeros((n, 5, robot.dof)))
            sim.step(3)


@verifies("teleport")
def frames_of_floating_bases_move(subject: SimulatorUnderTest) -> None:
    """For a floating robot, ``frame_velocity`` includes the base's twist and predicts the motion in the next step."""
    with subject.build(FLOATING, gravity=WEIGHTLESS, floor=False, num_threads=1) as (sim, robot):
        n = sim.num_envs
        robot.write_base_twist(spread(-0.4, 0.4, (n, 3)), spread(-0.6, 0.6, (n, 3), seed=1))
        before, velocity = robot.frame_pose("tcp")[0].copy(), robot.frame_velocity("tcp")[0].copy()
        sim.step(1)
        moved = (robot.frame_pose("tcp")[0] - before) / TIMESTEP
        expect_close(moved, velocity, 0.02, "frame_velocity('tcp') of a floating robot, compared with its motion [m/s]")


@verifies("snapshot")
def snapshots_hold_all(subject: SimulatorUnderTest) -> None:
    """A snapshot contains new arrays with one row per environment, including the commands and command modes."""
    with subject.build(LIFT, mode=CommandMode.VELOCITY, gravity=WEIGHTLESS, num_threads=1) as (sim, robot):
        n = sim.num_envs
        robot.command(np.tile([0.2, -0.8], (n, 1)) * (1 + np.arange(n)[:, None]))
        sim.step(20)
        snapshot = sim.snapshot()
        expect_rows(snapshot, n, "snapshot()")
        sim.step(20)
        expected = robot.joint_positions.copy()
        robot.command(np.zeros((n, 2)))
        sim.step(20)
        sim.restore(snapshot)
        sim.step(20)
        expect_close(
            expected, robot.joint_positions, 1e-9, "joint_positions 20 steps after a restore, without a new command"
        )


def rows_of_a_single(subject: SimulatorUnderTest) -> None:
    """A simulation of one environment returns arrays with one row and accepts masks."""
    if subject.num_envs == 1:
        raise NotApplicable("the simulator supports only one environment, so the other checks already test this case")
    with subject.build(num_envs=1, bodies=subject.free_bodies, num_threads=1) as (sim, robot):
        expect(robot.joint_positions.shape == (1, 2), f"joint_positions is {robot.joint_positions.shape}, not (1, 2).")
        sim.step(2)
        sim.reset(np.array([False]))
        expect_close([2 * TIMESTEP], sim.time, 1e-9, "time after a reset with an empty mask [s]")
        sim.reset(np.array([True]))
        expect_close([0.0], sim.time, 0.0, "time after a reset [s]")


def _readings(sim: Simulation, robot: RobotHandle) -> list[tuple[str, Callable[[], Floats], tuple[int, ...]]]:
    n, dof = sim.num_envs, robot.dof
    readings: list[tuple[str, Callable[[], Floats], tuple[int, ...]]] = [
        ("joint_positions", lambda: robot.joint_positions, (n, dof)),
        ("joint_velocities", lambda: robot.joint_velocities, (n, dof)),
        ("joint_efforts", lambda: robot.joint_efforts, (n, dof)),
        ("base_pose[0]", lambda: robot.base_pose[0], (n, 3)),
        ("base_pose[1]", lambda: robot.base_pose[1], (n, 4)),
        ("base_twist[0]", lambda: robot.base_twist[0], (n, 3)),
        ("frame_pose('tcp')[0]", lambda: robot.frame_pose("tcp")[0], (n, 3)),
        ("frame_pose('tcp')[1]", lambda: robot.frame_pose("tcp")[1], (n, 4)),
        ("frame_velocity('tcp')[1]", lambda: robot.frame_velocity("tcp")[1], (n, 3)),
    ]
    if "ball" in sim.bodies:
        ball = sim.bodies["ball"]
        readings += [
            ("the ball's pose[0]", lambda: ball.pose[0], (n, 3)),
            ("the ball's pose[1]", lambda: ball.pose[1], (n, 4)),
            ("the ball's twist[0]", lambda: ball.twist[0], (n, 3)),
        ]
    return readings
