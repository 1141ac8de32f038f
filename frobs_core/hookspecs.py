"""The hooks that a plugin may implement: one for each of the five kinds, and three that extend the contracts.

A plugin is a module that an entry point of the group ``frobs`` names. Its hooks are called once, when
the plugins are loaded, never while an environment steps.
"""

from __future__ import annotations

from collections.abc import Sequence

import pluggy

from frobs_core.specs import (
    AbilityRecord,
    AlgorithmRecord,
    ControllerRecord,
    ParameterRecord,
    RobotRecord,
    SensorTypeRecord,
    SimulatorRecord,
    TaskRecord,
)

hookspec = pluggy.HookspecMarker("frobs")
hookimpl = pluggy.HookimplMarker("frobs")


@hookspec
def frobs_simulators() -> Sequence[SimulatorRecord]:  # type: ignore[empty-body]
    """Offer simulators.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.SimulatorRecord`.

    Example::

        @hookimpl
        def frobs_simulators():
            return [SimulatorRecord(name="mujoco", summary="…", entry_point="frobs_sim_mujoco.simulation:MujocoSimulation",
                                    capabilities={"snapshot": Level.EXACT})]

    Do not import the engine here: ``entry_point`` is imported when a simulation is first built.
    """


@hookspec
def frobs_robots() -> Sequence[RobotRecord]:  # type: ignore[empty-body]
    """Offer robots.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.RobotRecord`.

    Example::

        @hookimpl
        def frobs_robots():
            return [RobotRecord(name="irb120", summary="…", entry_point="frobs_robots_abb.irb120:IRB120")]

    Do not read model files here: they are read when the robot is first built.
    """


@hookspec
def frobs_controllers() -> Sequence[ControllerRecord]:  # type: ignore[empty-body]
    """Offer controllers.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.ControllerRecord`.

    Example::

        @hookimpl
        def frobs_controllers():
            return [ControllerRecord(name="joint_position", summary="…",
                                     entry_point="frobs_controllers.joint_position:JointPosition")]

    Do not write a generator: it would only fail when it is iterated.
    """


@hookspec
def frobs_tasks() -> Sequence[TaskRecord]:  # type: ignore[empty-body]
    """Offer tasks, and the Gymnasium IDs that combine them with robots.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.TaskRecord`.

    Example::

        @hookimpl
        def frobs_tasks():
            return [TaskRecord(name="reach", summary="…", entry_point="frobs_tasks_reach.reach:Reach",
                               environments=(EnvironmentRecord(id="frobs/Irb120Reach-v0", …),))]

    Do not call ``gymnasium.register`` yourself: the registry does, and never overwrites another's ID.
    """


@hookspec
def frobs_algorithms() -> Sequence[AlgorithmRecord]:  # type: ignore[empty-body]
    """Offer learning algorithms.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.AlgorithmRecord`.

    Example::

        @hookimpl
        def frobs_algorithms():
            return [AlgorithmRecord(name="ppo", summary="…", entry_point="frobs_algos_sb3.ppo:PPO")]

    Do not import torch here: ``entry_point`` is imported when training starts.
    """


@hookspec
def frobs_abilities() -> Sequence[AbilityRecord]:  # type: ignore[empty-body]
    """Offer abilities that simulators may have, beside those of the core.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.AbilityRecord`.

    Example::

        @hookimpl
        def frobs_abilities():
            return [AbilityRecord(name="wind", summary="a wind that pushes bodies", methods=("wind_velocity",))]

    Do not offer a name of the core again: it would only be found as ``"distribution:name"``.
    """


@hookspec
def frobs_sensor_types() -> Sequence[SensorTypeRecord]:  # type: ignore[empty-body]
    """Offer types of sensors.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.SensorTypeRecord`.

    Example::

        @hookimpl
        def frobs_sensor_types():
            return [SensorTypeRecord(name="anemometer", summary="…", entry_point="acme.wind:Anemometer")]

    Do not import the instrument here: it is imported when an environment has such a sensor.
    """


@hookspec
def frobs_parameters() -> Sequence[ParameterRecord]:  # type: ignore[empty-body]
    """Offer physical parameters that can be randomized.

    Called once, when plugins are loaded. Return a list of :class:`~frobs_core.specs.ParameterRecord`.

    Example::

        @hookimpl
        def frobs_parameters():
            return [ParameterRecord(name="wind_speed", summary="speed of the wind [m/s]", ability="wind")]

    Do not offer a name that ``randomize`` knows already.
    """
