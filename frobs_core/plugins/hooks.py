"""Hooks that a plugin may implement.

Five hooks provide the main kinds of records: simulators, robots, controllers, tasks and algorithms. The hook
``frobs_extensions`` provides all other records. A plugin is a module that is registered as an entry point in the group
``frobs``. Hooks are called once, when plugins are loaded, and never while an environment is being stepped.
"""

from __future__ import annotations

from collections.abc import Sequence

import pluggy

from frobs_core.plugins.records import (
    AlgorithmRecord,
    CapabilityRecord,
    ControllerRecord,
    ParameterRecord,
    Record,
    RobotRecord,
    SensorTypeRecord,
    SimulatorRecord,
    TaskRecord,
)

hookspec = pluggy.HookspecMarker("frobs")
hookimpl = pluggy.HookimplMarker("frobs")


@hookspec
def frobs_simulators() -> Sequence[SimulatorRecord]:  # type: ignore[empty-body]
    """Provide simulators; called once when plugins are loaded. Return a list of ``SimulatorRecord``.

    Example::

        @hookimpl
        def frobs_simulators():
            return [SimulatorRecord(name="mujoco", summary="MuJoCo 3, stepped in batches",
                                    entry_point="frobs_sim_mujoco.simulation:MujocoSimulation",
                                    install_hint="pip install frobs-sim-mujoco",
                                    capabilities={"snapshot": Level.EXACT, "drive": Level.EXACT})]

    Do not import the engine in this hook: ``entry_point`` is imported when a simulation is first built.
    """


@hookspec
def frobs_robots() -> Sequence[RobotRecord]:  # type: ignore[empty-body]
    """Provide robots; called once when plugins are loaded. Return a list of ``RobotRecord``.

    Example::

        @hookimpl
        def frobs_robots():
            return [RobotRecord(name="irb120", summary="ABB IRB 120, an arm with six joints",
                                entry_point="frobs_robots_abb.irb120:IRB120",
                                install_hint="pip install frobs-robots-abb")]

    Do not read model files in this hook: they are read when the robot is first built.
    """


@hookspec
def frobs_controllers() -> Sequence[ControllerRecord]:  # type: ignore[empty-body]
    """Provide controllers; called once when plugins are loaded. Return a list of ``ControllerRecord``.

    Example::

        @hookimpl
        def frobs_controllers():
            return [ControllerRecord(name="joint_position", summary="the positions of the joints",
                                     entry_point="frobs_controllers.joint_position:JointPosition",
                                     install_hint="pip install frobs-controllers",
                                     needs={"drive": Level.APPROXIMATE})]

    Do not write the hook as a generator, because a generator raises errors only when it is iterated.
    """


@hookspec
def frobs_tasks() -> Sequence[TaskRecord]:  # type: ignore[empty-body]
    """Provide tasks and their Gymnasium IDs; called once when plugins are loaded. Return a list of ``TaskRecord``.

    Each ID combines a task with a robot and a controller.

    Example::

        @hookimpl
        def frobs_tasks():
            reach = EnvironmentRecord(id="lab/Irb120Reach-v0", summary="the IRB 120 reaches for a point",
                                      robot="irb120", controller="joint_delta_position", max_episode_steps=50)
            return [TaskRecord(name="reach", summary="move the tool to a goal",
                               entry_point="frobs_tasks_reach.reach:Reach",
                               install_hint="pip install frobs-tasks-reach",
                               needs={"teleport": Level.APPROXIMATE}, environments=(reach,))]

    Do not call ``gymnasium.register`` yourself: the registry registers the IDs and never overwrites an existing ID.
    """


@hookspec
def frobs_algorithms() -> Sequence[AlgorithmRecord]:  # type: ignore[empty-body]
    """Provide learning algorithms; called once when plugins are loaded. Return a list of ``AlgorithmRecord``.

    Example::

        @hookimpl
        def frobs_algorithms():
            return [AlgorithmRecord(name="ppo", summary="proximal policy optimization",
                                    entry_point="frobs_algos_sb3.ppo:PPO",
                                    install_hint="pip install frobs-algos-sb3",
                                    action_spaces=("Box", "Discrete"))]

    Do not import torch in this hook: ``entry_point`` is imported when training starts.
    """


@hookspec
def frobs_extensions() -> Sequence[Record]:  # type: ignore[empty-body]
    """Provide everything else: capabilities, sensor types, parameters, formats of model files, policies, viewers.

    This hook is called once, when plugins are loaded. Return a list of records. The class of each record determines its
    kind. Other distributions may define further classes of records; see ``Record``.

    Example::

        @hookimpl
        def frobs_extensions():
            return [CapabilityRecord(name="wind", summary="a wind that pushes bodies", methods=("wind_velocity",),
                                  install_hint="pip install acme-wind"),
                    SensorTypeRecord(name="anemometer", summary="velocity of the wind [m/s]",
                                     entry_point="acme.wind:Anemometer", install_hint="pip install acme-wind"),
                    ParameterRecord(name="wind_speed", summary="speed of the wind [m/s]", capability="wind",
                                    install_hint="pip install acme-wind")]

    Do not import implementations in this hook: they are imported when an environment uses them.
    """


@hookspec
def frobs_abilities() -> Sequence[CapabilityRecord]:  # type: ignore[empty-body]
    """Provide capabilities. Deprecated since 0.3: use :func:`frobs_extensions`."""


@hookspec
def frobs_sensor_types() -> Sequence[SensorTypeRecord]:  # type: ignore[empty-body]
    """Provide sensor types. Deprecated since 0.3: use :func:`frobs_extensions`."""


@hookspec
def frobs_parameters() -> Sequence[ParameterRecord]:  # type: ignore[empty-body]
    """Provide physical parameters. Deprecated since 0.3: use :func:`frobs_extensions`."""
