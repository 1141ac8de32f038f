"""The frozen records that plugins offer: what is listed without importing anything heavy."""

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
    """What all kinds have in common.

    Attributes:
        name: What users write: lower case, digits and underscores.
        summary: One line for lists.
        entry_point: ``"module:attribute"`` of the implementation, imported when it is first used.
        install_hint: The command that installs what the implementation needs.
    """

    name: str
    summary: str
    entry_point: str
    install_hint: str = ""

    def load(self) -> Any:
        """Import and return the implementation.

        Raises:
            PluginError: The module or the attribute is missing, or fails to import.
        """
        module, _, attribute = self.entry_point.partition(":")
        try:
            return getattr(import_module(module), attribute)
        except PluginError:  # the module itself says what to do
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
        capabilities: Level of each thing it can do; what is absent is unsupported.
    """

    capabilities: Mapping[str, Level]

    @property
    def is_paced(self) -> bool:
        """Whether the world moves on by itself and ``step`` waits for it: the simulator has the ability ``real_time``."""
        return bool(self.capabilities.get("real_time", Level.UNSUPPORTED))


@dataclass(frozen=True, kw_only=True)
class RobotRecord(Record):
    """A robot; ``entry_point`` names a :class:`frobs_core.interfaces.Robot`, which is data."""


@dataclass(frozen=True, kw_only=True)
class ControllerRecord(Record):
    """A controller; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Controller`.

    Attributes:
        needs: Lowest level of each capability that it needs.
        control_timestep: Between two of its actions where nobody says [s]; None: the task's own.
    """

    needs: Mapping[str, Level] = field(default_factory=dict)
    control_timestep: float | None = None


@dataclass(frozen=True, kw_only=True)
class EnvironmentRecord:
    """A Gymnasium ID: a task with a robot, and what its constructor is given by default.

    Attributes:
        id: ``"frobs/Irb120Reach-v0"``; a change of its behaviour raises the version.
        summary: One line for lists.
        robot: Name of the robot; empty: whoever makes the environment says which.
        controller: Name of the controller.
        max_episode_steps: Control steps before truncation.
        simulator: Name of the simulator.
        parameters: Further keywords of :class:`frobs_core.env.RobotEnv`.
        pretrained: A policy bundle that comes with it, as ``frobs export`` writes one: ``"package:path.frobs"``; empty:
            there is none.
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
        needs: Lowest level of each capability that it needs.
        arrays: The array libraries that its terms accept.
        environments: The Gymnasium IDs that it registers.
    """

    needs: Mapping[str, Level] = field(default_factory=dict)
    arrays: tuple[str, ...] = ("numpy",)
    environments: tuple[EnvironmentRecord, ...] = ()


@dataclass(frozen=True, kw_only=True)
class AlgorithmRecord(Record):
    """An algorithm; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Algorithm`.

    Attributes:
        action_spaces: The Gymnasium spaces that it can act in: ``"Box"``, ``"Discrete"``, …
        tuned: Configuration files that were tuned, by environment ID: ``"package:path.yaml"``.
        search_space: What ``frobs tune`` varies where it is told nothing else: ``"package:path.yaml"``; empty: nothing.
        config_files: Other layouts of YAML files that ``frobs train --config`` takes: a dotted key by which such a file
            is known, and the ``"module:function"`` that is called with the file's mapping, the algorithm's name and the
            path, and returns keys of a run's configuration and one line on what has no place there.
        model_files: Files of trained models that ``frobs evaluate --model`` takes: a suffix (``".zip"``), and the
            ``"module:function"`` that is called with the path, the environment's observation space and action space,
            the algorithm's name or None, and whether the file is trusted, and returns what has the spaces and
            ``predict`` of an algorithm, and the environment steps that it had trained for.
        exact_resume: Whether a training that is saved, loaded and continued equals an uninterrupted one. If not, a run
            says so when it is resumed.
        reproducible: Whether the same seed learns the same. An algorithm that learns while its environments run does not.
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
    """An ability that a plugin adds to those of the core: something that a simulator may be able to do.

    Simulators declare it in their ``capabilities``; tasks, controllers, sensors and parameters may need it.

    Attributes:
        entry_point: Empty: an ability has no implementation of its own.
        methods: Methods that the class of a simulator with this ability defines.
    """

    entry_point: str = ""
    methods: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SensorTypeRecord(Record):
    """A type of sensor; ``entry_point`` names a subclass of :class:`frobs_core.interfaces.Sensor`.

    Its name is what ``type`` means in the sensor settings of an environment.
    """


@dataclass(frozen=True, kw_only=True)
class ParameterRecord(Record):
    """A physical parameter that can be randomized, of simulators with an ability.

    Such a simulator lists the targets in ``parameter_targets``, and reads and writes the parameter, (num_envs,) for each
    target, with ``parameter`` and ``write_parameter``.

    Attributes:
        entry_point: Empty: the simulator implements it.
        ability: Ability that a simulator needs.
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
"""The five kinds, in the order in which they are listed."""

EXTENSIONS: Mapping[str, type[Record]] = {
    "ability": AbilityRecord,
    "sensor_type": SensorTypeRecord,
    "parameter": ParameterRecord,
}
"""What else a plugin may offer: additions to the contracts."""

RECORDS: Mapping[str, type[Record]] = {**KINDS, **EXTENSIONS}
"""All that a plugin may offer."""
