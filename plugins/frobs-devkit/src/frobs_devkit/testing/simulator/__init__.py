"""Checks of a simulator, on small robots and scenes of the kit's own."""

from __future__ import annotations

from frobs_core import plugins
from frobs_core.capabilities import CAPABILITIES, Level
from frobs_core.interfaces import Simulation
from frobs_core.specs import SimulatorRecord
from frobs_devkit.testing.checks import Check, Outcome, collect, expect
from frobs_devkit.testing.simulator import (
    contacts,
    contract,
    drive,
    kinematics,
    model_files,
    parameters,
    pictures,
    running,
    state,
    world,
)
from frobs_devkit.testing.simulator.subject import SimulatorUnderTest


def capabilities_are_known(subject: SimulatorUnderTest) -> Outcome:
    """The record names known capabilities with levels, and its entry point a subclass of Simulation."""
    for name, level in subject.record.capabilities.items():
        expect(name in CAPABILITIES, f"'{name}' is no capability; known are {', '.join(CAPABILITIES)}.")
        expect(isinstance(level, Level), f"the level of '{name}' is {level!r}, no Level.")
    cls = subject.record.load()
    expect(isinstance(cls, type) and issubclass(cls, Simulation), f"{cls} is no subclass of Simulation.")
    return None


CHECKS = (
    capabilities_are_known,
    contract.arrays_have_their_shapes,
    contract.writes_broadcast,
    contract.rows_of_a_single,
    contract.robots_stand_apart,
    contract.static_bodies_stay,
    contract.unknown_targets_refused,
    kinematics.joints_are_the_files,
    kinematics.frames_are_current,
    kinematics.given_joints_leave_the_state,
    kinematics.jacobian_is_the_derivative,
    kinematics.frame_velocity_is_current,
    kinematics.unknown_frames_refused,
    kinematics.bases_are_placed,
    model_files.elements_are_accounted_for,
    model_files.mimics_follow,
    model_files.overlaps_are_told,
    model_files.overlapping_links_let_each_other_be,
    model_files.broken_meshes_are_refused,
    contract.frames_of_floating_bases_move,
    drive.drives_follow_positions,
    drive.drives_saturate,
    drive.drives_follow_velocities,
    drive.drives_apply_efforts,
    drive.command_rows_are_steps,
    drive.commands_are_kept,
    drive.a_new_mode_holds,
    drive.wheels_roll,
    running.time_counts_steps,
    state.joints_are_placed,
    state.floating_bases_fly,
    state.reset_honours_the_mask,
    state.snapshots_continue,
    contract.snapshots_hold_all,
    running.motion_repeats,
    running.rows_equal_singles,
    running.time_stands_between_steps,
    running.steps_take_their_time,
    running.spawning_is_seen,
    running.divergence_is_contained,
    running.close_twice,
    world.bodies_are_placed,
    world.rays_measure,
    world.lidars_measure,
    world.contacts_are_told,
    contacts.contacts_of_robots_are_told,
    contacts.contacts_can_ignore,
    contacts.contacts_end_with_a_reset,
    world.wrenches_push,
    world.cameras_see,
    world.depth_is_in_metres,
    world.contradictions_are_refused,
    pictures.pictures_are_true,
    parameters.gravity_shows,
    parameters.mass_shows,
    parameters.gains_show,
    parameters.joint_damping_shows,
    parameters.friction_shows,
    parameters.parameters_stay,
    parameters.inertia_follows_mass,
    parameters.drives_hold_as_gains_change,
    parameters.frames_without_mass_refused,
)
"""Every check of a simulator, in the order in which they run."""


def check_simulator(simulator: str | SimulatorRecord) -> list[Check]:
    """Return the checks of a simulator.

    A capability is checked where the record claims it: to the last digits where it claims ``exact``, within a few
    percent where it claims ``approximate``. :attr:`Report.verified_capabilities` says which of them held.

    Args:
        simulator: Its name, or a record that is not installed yet.

    Raises:
        UnknownNameError: No simulator has this name.
    """
    record = plugins.get_record("simulator", simulator) if isinstance(simulator, str) else simulator
    assert isinstance(record, SimulatorRecord)
    return collect(SimulatorUnderTest(record), CHECKS)
