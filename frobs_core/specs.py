"""Immutable records that plugins provide. They can be listed without heavy imports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from frobs_core.capabilities import Level
from frobs_core.errors import PluginError
from frobs_core.install_hints import local_install_hint


@dataclass(frozen=True, kw_only=True)
class Record:
    """Common fields of all records.

    Attributes:
        name: Name that users write: lowercase letters, digits and underscores.
        summary: One line for lists.
        entry_point: ``"module:attribute"`` of the implementation, imported on first use.
        install_hint: Command that installs the implementation's dependencies.
    """

    name: str
    summary: str
    entry_point: str
    install_hint: str = ""

    def load(self) -> Any:
        """Import and return the implementation.

        Raises:
            PluginError: The module cannot be imported, or the attribute is missing.
        """
        module, _, attribute = self.entry_point.partition(":")
        try:
            return getattr(import_module(module), attribute)
        except PluginError:  # the module's own message says what to do
            raise
        except Exception as error:
            hint = f" To install what it needs: {local_install_hint(self.install_hint)}." if self.install_hint else ""
            raise PluginError(
                f"'{self.name}' cannot be imported from '{self.entry_point}': {type(error).__name__}: {error}.{hint}"
            ) from error


@dataclass(frozen=True, kw_only=True)
class SimulatorRecord(Record):
    """A simulator; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Simulation`.

    Attributes:
        capabilities: Support level of each capability. Omitted capabilities are unsupported.
    """

    capabilities: Mapping[str, Level]

    @property
    def is_paced(self) -> bool:
        """Whether the world runs by itself and ``step`` waits for it (ability ``real_time``)."""
        return bool(self.capabilities.get("real_time", Level.UNSUPPORTED))


@dataclass(frozen=True, kw_only=True)
class RobotRecord(Record):
    """A robot; ``entry_point`` names a :class:`frobs_core.interfaces.Robot`, which is data."""


@dataclass(frozen=True, kw_only=True)
class ControllerRecord(Record):
    """A controller; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Controller`.

    Attributes:
        needs: Minimum level of each capability that it requires.
        control_timestep: Default time between two of its actions [s], or None for the task's default.
    """

    needs: Mapping[str, Level] = field(default_factory=dict)
    control_timestep: float | None = None


@dataclass(frozen=True, kw_only=True)
class EnvironmentRecord:
    """A Gymnasium ID: a task with a robot, and default keywords of the environment.

    Attributes:
        id: ``"frobs/Irb120Reach-v0"``. The version is incremented whenever its behavior changes.
        summary: One line for lists.
        robot: Name of the robot, or empty if the user must choose one.
        controller: Name of the controller.
        max_episode_steps: Control steps before truncation.
        simulator: Name of the simulator.
        parameters: Additional keywords of :class:`frobs_core.env.RobotEnv`.
        pretrained: Policy bundle shipped with it, in the format of ``frobs export``: ``"package:path.frobs"``, or empty
            if there is none.
    """

    id: str
    summary: str
    robot: str
    controller: str
    max_episode_steps: int
    simulator: str = "mujoco"
    parameters: Mapping[str, Any] = field(default_factory=dict)
    pretrained: str = ""


@dataclass(frozen=True, kw_only=True)
class TaskRecord(Record):
    """A task; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Task`.

    Attributes:
        needs: Minimum level of each capability that it requires.
        arrays: Array libraries that its terms support.
        environments: The Gymnasium IDs that it registers.
    """

    needs: Mapping[str, Level] = field(default_factory=dict)
    arrays: tuple[str, ...] = ("numpy",)
    environments: tuple[EnvironmentRecord, ...] = ()


@dataclass(frozen=True, kw_only=True)
class AlgorithmRecord(Record):
    """An algorithm; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Algorithm`.

    Attributes:
        action_spaces: Supported Gymnasium action spaces: ``"Box"``, ``"Discrete"``, …
        tuned: Tuned configuration files, by environment ID: ``"package:path.yaml"``.
        search_space: Default search space for ``frobs tune``: ``"package:path.yaml"``, or empty if there is none.
        config_files: Additional YAML formats for ``frobs train --config``: each has a dotted key that identifies such a
            file, and a ``"module:function"``. The function receives the file's mapping, the algorithm's name and the
            path. It returns run configuration keys and one line about settings that have no equivalent.
        model_files: File formats of trained models for ``frobs evaluate --model``, each with a suffix (``".zip"``) and
            a ``"module:function"``. The function receives the path, the environment's observation space and action
            space, the algorithm's name or None, and whether the file is trusted. It returns an object with the spaces
            and the ``predict`` method of an algorithm, and the number of environment steps for which it was trained.
        exact_resume: Whether a training run that is saved, loaded and continued gives the same result as an
            uninterrupted one. If not, a message says so when the run is resumed.
        reproducible: Whether training with the same seed gives the same result. This is not the case for algorithms
            that learn while their environments are being stepped.
    """

    action_spaces: tuple[str, ...] = ("Box",)
    tuned: Mapping[str, str] = field(default_factory=dict)
    search_space: str = ""
    config_files: Mapping[str, str] = field(default_factory=dict)
    model_files: Mapping[str, str] = field(default_factory=dict)
    exact_resume: bool = True
    reproducible: bool = True


@dataclass(frozen=True, kw_only=True)
class AbilityRecord(Record):
    """An additional simulator ability, defined by a plugin.

    Simulators declare it in their ``capabilities``; tasks, controllers, sensors and parameters can require it.

    Attributes:
        entry_point: Empty, because an ability has no implementation of its own.
        methods: Methods that simulators with this ability implement.
    """

    entry_point: str = ""
    methods: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SensorTypeRecord(Record):
    """A type of sensor; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Sensor`.

    Use its name as ``type`` in the sensor settings of an environment.
    """


@dataclass(frozen=True, kw_only=True)
class ParameterRecord(Record):
    """A physical parameter that can be randomized on simulators with a given ability.

    Such a simulator lists the targets in ``parameter_targets``. It reads and writes the parameter, (num_envs,) for each
    target, in ``parameter`` and ``write_parameter``.

    Attributes:
        entry_point: Empty, because the simulator implements it.
        ability: Ability that the simulator must have.
    """

    entry_point: str = ""
    ability: str


KINDS: Mapping[str, type[Record]] = {
    "simulator": SimulatorRecord,
    "robot": RobotRecord,
    "controller": ControllerRecord,
    "task": TaskRecord,
    "algorithm": AlgorithmRecord,
}
"""The five kinds, in listing order."""

EXTENSIONS: Mapping[str, type[Record]] = {
    "ability": AbilityRecord,
    "sensor_type": SensorTypeRecord,
    "parameter": ParameterRecord,
}
"""Other records that a plugin may provide to extend the contracts."""

RECORDS: Mapping[str, type[Record]] = {**KINDS, **EXTENSIONS}
"""All records that a plugin may provide."""
