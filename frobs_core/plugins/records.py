"""Immutable records that plugins provide. Records can be listed without importing the implementations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, ClassVar, TypeVar

from frobs_core.deprecation import warn_deprecated
from frobs_core.util.attributes import load_attribute
from frobs_core.util.errors import FrobsError, PluginError
from frobs_core.util.install_hints import local_install_hint


class Level(IntEnum):
    """Support level of a capability. A level also satisfies requirements for lower levels."""

    UNSUPPORTED = 0
    APPROXIMATE = 1
    EXACT = 2

    def __str__(self) -> str:
        """Return the name in lowercase, as shown in tables."""
        return self.name.lower()


@dataclass(frozen=True, kw_only=True)
class Record:
    """Common fields of all records.

    Attributes:
        name: Name of the object, in lowercase letters, digits and underscores.
        summary: One line for lists.
        entry_point: Implementation, as ``"module:attribute"``. The module is imported on first use.
        install_hint: Command that installs the implementation's dependencies.
    """

    name: str
    summary: str
    entry_point: str
    install_hint: str = ""

    kind: ClassVar[str] = ""
    """Kind of the record. Each direct subclass defines its kind, in lowercase letters and underscores."""

    def load(self) -> Any:
        """Import and return the implementation.

        Raises:
            PluginError: The module cannot be imported, or the attribute is missing.
        """
        try:
            return load_attribute(self.entry_point)
        except PluginError:  # the module's error message already explains the fix
            raise
        except FrobsError as error:  # so does this message, for example that an engine is not installed
            raise PluginError(f"'{self.name}' cannot be used: {error}") from error
        except Exception as error:
            hint = f" To install what it needs: {local_install_hint(self.install_hint)}." if self.install_hint else ""
            raise PluginError(
                f"'{self.name}' cannot be imported from '{self.entry_point}': {type(error).__name__}: "
                f"{str(error).rstrip('.')}.{hint}"
            ) from error


AnyRecord = TypeVar("AnyRecord", bound=Record)


@dataclass(frozen=True, kw_only=True)
class SimulatorRecord(Record):
    """Record of a simulator. ``entry_point`` names a subclass of :class:`frobs_core.contracts.Simulation`.

    Attributes:
        capabilities: Support level of each capability. Omitted capabilities are unsupported.
    """

    kind: ClassVar[str] = "simulator"

    capabilities: Mapping[str, Level]

    @property
    def is_paced(self) -> bool:
        """Whether the simulation runs continuously, so that ``step`` must wait for it (capability ``real_time``)."""
        return bool(self.capabilities.get("real_time", Level.UNSUPPORTED))


@dataclass(frozen=True, kw_only=True)
class RobotRecord(Record):
    """Record of a robot. ``entry_point`` names an instance of :class:`frobs_core.description.Robot`."""

    kind: ClassVar[str] = "robot"


@dataclass(frozen=True, kw_only=True)
class ControllerRecord(Record):
    """Record of a controller. ``entry_point`` names a subclass of :class:`frobs_core.contracts.Controller`.

    Attributes:
        needs: Minimum level of each capability that the controller requires.
        control_timestep: Default time between two actions [s], or None for the task's default.
    """

    kind: ClassVar[str] = "controller"

    needs: Mapping[str, Level] = field(default_factory=dict)
    control_timestep: float | None = None


class ControllerDefaults(dict[str, Any]):
    """Keywords that an ID sets for its own controller. If the user chooses another controller, they do not apply.

    Args:
        controller: Name of the ID's controller.
        keywords: Keywords of this controller.
    """

    def __init__(self, controller: str, keywords: Mapping[str, Any]) -> None:
        super().__init__(keywords)
        self.controller = controller

    def of(self, chosen: Any) -> dict[str, Any]:
        """Return the keywords for a chosen controller, or for a mapping from joint groups to controllers."""
        if isinstance(chosen, Mapping):
            return {group: self for group, one in chosen.items() if self._is_own(one)}
        return self if self._is_own(chosen) else {}

    def _is_own(self, chosen: Any) -> bool:
        return (chosen.name if isinstance(chosen, ControllerRecord) else chosen) == self.controller


class SimulatorDefaults(dict[str, Any]):
    """Keywords that an ID sets for any simulator, and further ones that it sets only for some simulators.

    Args:
        keywords: Keywords for all simulators.
        only: Further keywords, by the name of the simulator to which they apply.
    """

    def __init__(self, keywords: Mapping[str, Any], **only: Mapping[str, Any]) -> None:
        super().__init__(keywords)
        self.only = only

    def of(self, chosen: str | SimulatorRecord) -> dict[str, Any]:
        """Return the keywords for the ``chosen`` simulator."""
        return {**self, **self.only.get(chosen.name if isinstance(chosen, SimulatorRecord) else chosen, {})}


@dataclass(frozen=True, kw_only=True)
class EnvironmentRecord:
    """Record of a Gymnasium ID, which combines a task, a robot and default keywords for the environment.

    Attributes:
        id: Gymnasium ID, such as ``"frobs/Irb120Reach-v0"``. The ID's version is incremented whenever the environment's
            behavior changes.
        summary: One line for lists.
        robot: Name of the robot, or an empty string if the user must choose a robot.
        controller: Name of the controller.
        max_episode_steps: Control steps before truncation.
        simulator: Name of the simulator.
        parameters: Additional keywords of :class:`frobs_core.kernel.env.RobotEnv`. ``controller_kwargs`` apply only to
            ``controller``, and not to another controller that the user chooses. ``simulator_kwargs`` can be
            ``SimulatorDefaults``.
        pretrained: Policy bundle that is shipped with the environment, as ``"package:path.frobs"``, or an empty string.
            ``frobs export`` creates such bundles.
        algorithm: Name of the algorithm that ``frobs train`` uses unless the user chooses another.
    """

    id: str
    summary: str
    robot: str
    controller: str
    max_episode_steps: int
    simulator: str = "mujoco"
    parameters: Mapping[str, Any] = field(default_factory=dict)
    pretrained: str = ""
    algorithm: str = "ppo"


@dataclass(frozen=True, kw_only=True)
class TaskRecord(Record):
    """Record of a task. ``entry_point`` names a subclass of :class:`frobs_core.contracts.Task`.

    Attributes:
        needs: Minimum level of each capability that the task requires.
        arrays: Array libraries that the task's terms support.
        environments: Gymnasium IDs to register for the task.
    """

    kind: ClassVar[str] = "task"

    needs: Mapping[str, Level] = field(default_factory=dict)
    arrays: tuple[str, ...] = ("numpy",)
    environments: tuple[EnvironmentRecord, ...] = ()


@dataclass(frozen=True, kw_only=True)
class AlgorithmRecord(Record):
    """Record of an algorithm. ``entry_point`` names a subclass of :class:`frobs_core.contracts.Algorithm`.

    Attributes:
        action_spaces: Supported Gymnasium action spaces, such as ``"Box"`` and ``"Discrete"``.
        tuned: Tuned configuration files in the form ``"package:path.yaml"``, by environment ID.
        search_space: Default search space for ``frobs tune``, as ``"package:path.yaml"``, or an empty string.
        config_files: Additional YAML formats. Deprecated since 0.3: provide ``frobs_train.ConfigLayoutRecord``.
        model_files: File formats of trained models for ``frobs evaluate --model``. Each key is a file suffix
            (``".zip"``), and each value names a function as ``"module:function"``. The function receives the path, the
            environment's observation space and action space, the algorithm's name or None, and whether the file is
            trusted. The function returns an object that has the spaces and the ``predict`` method of an algorithm, and
            the number of environment steps for which the model was trained.
        exact_resume: Whether a training run that is saved, loaded and continued produces the same result as an
            uninterrupted run. If this field is False, a message is shown when a run is resumed.
        reproducible: Whether two training runs with the same seed produce the same result. Algorithms that learn while
            their environments are being stepped are not reproducible.
    """

    kind: ClassVar[str] = "algorithm"

    action_spaces: tuple[str, ...] = ("Box",)
    tuned: Mapping[str, str] = field(default_factory=dict)
    search_space: str = ""
    config_files: Mapping[str, str] = field(default_factory=dict)
    model_files: Mapping[str, str] = field(default_factory=dict)
    exact_resume: bool = True
    reproducible: bool = True


@dataclass(frozen=True, kw_only=True)
class CapabilityRecord(Record):
    """Record of an additional simulator capability.

    Simulators declare the capability in their ``capabilities``. Tasks, controllers, sensors and parameters can require
    the capability.

    Attributes:
        entry_point: Always empty, because a capability does not have a separate implementation.
        methods: Methods that simulators with this capability implement.
    """

    kind: ClassVar[str] = "capability"

    entry_point: str = ""
    methods: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SensorTypeRecord(Record):
    """Record of a sensor type. ``entry_point`` names a subclass of :class:`frobs_core.description.Sensor`.

    The record's name is used as ``type`` in the sensor settings of an environment.
    """

    kind: ClassVar[str] = "sensor_type"


@dataclass(frozen=True, kw_only=True)
class ParameterRecord(Record):
    """Record of a physical parameter that can be randomized on simulators with a given capability.

    These simulators list the parameter's targets in ``parameter_targets``. The simulators' methods ``parameter`` and
    ``write_parameter`` read and write the parameter's values, (num_envs,) for each target.

    Attributes:
        entry_point: Always empty, because the simulator implements the parameter.
        capability: Capability that the simulator must have.
        ability: Name of ``capability`` in version 0.2.
    """

    kind: ClassVar[str] = "parameter"

    entry_point: str = ""
    capability: str = ""
    ability: str = ""

    def __post_init__(self) -> None:
        """Accept the name of version 0.2."""
        if self.ability:
            warn_deprecated("'ability' of ParameterRecord", instead="'capability'", since="0.3", removed_in="0.4")
            object.__setattr__(self, "capability", self.ability)


@dataclass(frozen=True, kw_only=True)
class ModelFormatRecord(Record):
    """Record of a format of model files. ``entry_point`` names a :class:`~frobs_core.contracts.ModelReader`.

    Attributes:
        suffixes: Suffixes of the files, in lowercase and with the dot.
        content: ``"robot"`` or ``"mesh"``.
    """

    kind: ClassVar[str] = "model_format"

    suffixes: tuple[str, ...]
    content: str = "robot"


@dataclass(frozen=True, kw_only=True)
class PolicyRecord(Record):
    """Record of a policy. ``entry_point`` names a subclass of :class:`frobs_core.contracts.Policy`.

    The name may have a second part after a colon, such as ``"teleop:keyboard"``.

    Attributes:
        suffixes: Endings of the paths that the policy opens: ``".frobs"``, ``"/"`` for folders, or ``""`` for all paths
            that no other policy opens. The path is the first argument of the class. By default, the policy has a name.
    """

    kind: ClassVar[str] = "policy"

    suffixes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ViewerRecord(Record):
    """Record of a viewer. ``entry_point`` names a subclass of :class:`frobs_core.contracts.Viewer`.

    The record's name is a valid ``render_mode`` of every environment.
    """

    kind: ClassVar[str] = "viewer"


KINDS: Mapping[str, type[Record]] = {
    record.kind: record for record in (SimulatorRecord, RobotRecord, ControllerRecord, TaskRecord, AlgorithmRecord)
}
"""The five main kinds of records, in the order in which they are listed."""

EXTENSIONS: Mapping[str, type[Record]] = {
    record.kind: record
    for record in (
        *(CapabilityRecord, SensorTypeRecord, ParameterRecord),
        *(ModelFormatRecord, PolicyRecord, ViewerRecord),
    )
}
"""Additional kinds of records: capabilities, sensor types, physical parameters, formats of model files, policies and
viewers.
"""

RECORDS: Mapping[str, type[Record]] = {**KINDS, **EXTENSIONS}
"""All kinds of records that the core defines. Other distributions may define further kinds of extensions."""

_EXPERT = "the scripted expert of the environment's task"
_POLICIES = "frobs_core.kernel.policies"
RECORDS_OF_CORE: Mapping[str, tuple[Record, ...]] = {
    "policy": (
        PolicyRecord(name="expert", summary=_EXPERT, entry_point=f"{_POLICIES}:TaskExpert"),
        PolicyRecord(name="random", summary="random actions", entry_point=f"{_POLICIES}:RandomPolicy"),
    ),
    "viewer": (
        ViewerRecord(
            name="human", summary="the window of the simulator", entry_point="frobs_core.contracts.viewer:EngineWindow"
        ),
    ),
}
"""Records of the core itself, by kind."""
