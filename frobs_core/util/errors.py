"""Exceptions that FRobs raises deliberately.

Class hierarchy::

    FrobsError
    ├── PluginError
    │   ├── PluginLoadError         a plugin cannot be imported or registered
    │   ├── UnknownNameError        no such simulator, robot, controller, task, algorithm, ID, …
    │   └── AmbiguousNameError      two distributions provide the same name
    ├── ConfigurationError
    │   ├── UnknownParameterError   a keyword is not accepted
    │   ├── ParameterValueError     a value is outside the range that its parameter accepts
    │   ├── MissingSettingError     a required setting is missing
    │   ├── ConflictingOptionsError options or settings cannot be combined
    │   ├── InvalidTimestepError    control_timestep is not a multiple of physics_timestep
    │   ├── ConfigFileError         a YAML file cannot be used; the message contains the file and the line
    │   ├── MissingDependencyError  an optional package is not installed
    │   ├── PhysicsParameterError   a physical parameter has an invalid value or cannot be changed
    │   ├── SettingError            a setting in sensors=… or randomize=… is invalid
    │   │   ├── ResetOptionError    a value in reset(options=…) is invalid
    │   │   └── SceneError          a scene is inconsistent, or the simulator cannot build it
    │   ├── UnsuitableRobotError    a task, controller or tool cannot use this robot
    │   ├── IncompatibleSpaceError  an algorithm, wrapper or controller cannot use this space
    │   ├── ModelMismatchError      a trained model or run was made for a different environment
    │   └── PolicyExportError       a policy cannot be exported
    ├── CapabilityError             the simulator does not support what a task or controller needs
    ├── ModelFileError              a URDF, xacro or MJCF file cannot be used
    ├── InvalidActionError          an action has the wrong shape or is not finite
    ├── ResetNeededError            step() is called before reset() or after the end of an episode
    ├── EnvironmentCopyError        an environment cannot be copied or pickled
    ├── SimulationError             the physics engine failed
    │   └── RenderingUnavailableError   OpenGL is not available
    ├── RunError
    │   ├── NonFiniteValueError     an observation, reward, action or network contains a number that is not finite
    │   └── CheckpointError         a checkpoint cannot be written or read
    └── UntrustedFileError          opening a file would execute code or load other files

Each constructor stores its arguments as attributes and builds the message, which contains the request, the available
choices and the fix.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from pathlib import Path

from frobs_core.deprecation import moved_names, renamed_attribute
from frobs_core.util.install_hints import local_install_hint

__getattr__ = moved_names(__name__, ["frobs_cli.errors"])

_LONGEST_REASON = 2_000  # [characters]


def nearest(name: str, available: Iterable[str]) -> str | None:
    """Return the member of ``available`` that is most similar to ``name``, or None if none is similar."""
    by_lower = {candidate.lower(): candidate for candidate in available}
    found = difflib.get_close_matches(name.lower(), by_lower, n=1, cutoff=0.5)
    return by_lower[found[0]] if found else None


_MOST_NAMES = 5
"""Maximum number of names that an error message lists. The most similar names are listed."""


def _suggestion(name: str, available: Sequence[str]) -> str:
    suggestion = nearest(name, available)
    return f" Did you mean '{suggestion}'?" if suggestion else ""


def _hint(name: str, available: Sequence[str]) -> str:
    return f"{_suggestion(name, available)} Available: {', '.join(available) if available else 'none'}."


def _short_hint(name: str, available: Sequence[str], more: str) -> str:
    """Return a suggestion and the most similar names. ``more`` is a command that lists all names, or ``""``."""
    if len(available) <= _MOST_NAMES:
        return _hint(name, available)
    similar = sorted(
        available, key=lambda known: difflib.SequenceMatcher(None, name.lower(), known.lower()).ratio(), reverse=True
    )
    rest = f"{len(available) - _MOST_NAMES} more{f': {more}' if more else ''}"
    return f"{_suggestion(name, available)} Available: {', '.join(similar[:_MOST_NAMES])} and {rest}."


_LISTS = {
    **{kind: f"frobs list {kind}s" for kind in ("simulator", "robot", "controller", "task", "algorithm")},
    "policy": "frobs list policies",
    "environment ID": "frobs list envs",
    "record or environment ID": "frobs list",
    "command": "frobs --help",
}
"""Command that lists all names of each kind."""


def _restore(kind: type[FrobsError], args: tuple[object, ...], state: dict[str, object]) -> FrobsError:
    error = kind.__new__(kind, *args)
    vars(error).update(state)
    return error


class FrobsError(Exception):
    """Base class of all exceptions that FRobs raises deliberately."""

    def __reduce__(self) -> tuple[object, ...]:
        """Return the fields and the message for pickling, because subclass constructors do not accept a message."""
        return _restore, (type(self), self.args, vars(self))


class PluginError(FrobsError):
    """A plugin cannot be used, or a name that a plugin should provide is missing."""


class PluginLoadError(PluginError):
    """A plugin cannot be imported or registered.

    Args:
        plugin: The entry point's name.
        distribution: The pip package that contains the plugin, with its version.
        cause: One line with the reason.
    """

    def __init__(self, plugin: str, distribution: str, cause: str) -> None:
        self.plugin, self.distribution, self.cause = plugin, distribution, cause
        super().__init__(f"plugin '{plugin}' of {distribution} did not load: {cause}")


class UnknownNameError(PluginError):
    """No object has this name.

    Args:
        kind: Kind of the object, such as ``"robot"``, ``"controller"`` or ``"environment ID"``.
        name: The requested name.
        available: The existing names.
        failed: One line for each plugin that failed to load and might have provided the name.
        install_hint: The command that installs the object, if known.
    """

    def __init__(
        self, kind: str, name: str, available: Iterable[str], failed: Sequence[str] = (), install_hint: str = ""
    ) -> None:
        self.kind = kind
        self.name = name = str(name)  # settings can contain numbers or None
        self.available = tuple(sorted(available))
        self.failed = tuple(failed)
        self.install_hint = local_install_hint(install_hint)
        text = f"no {kind} is named '{name}'.{_short_hint(name, self.available, _LISTS.get(kind, ''))}"
        if self.install_hint:
            text += f" To install it: {self.install_hint}."
        if self.failed:
            text += f" Plugins that failed to load: {'; '.join(self.failed)}."
        super().__init__(text)


def check_name(kind: str, name: str, available: Iterable[str]) -> str:
    """Return an existing name, or raise :class:`UnknownNameError`. For the arguments, see there."""
    if name not in available:
        raise UnknownNameError(kind, name, available)
    return name


class AmbiguousNameError(PluginError):
    """Two distributions provide the same name.

    Args:
        kind: The kind of the name.
        name: The requested name, without a distribution.
        distributions: Each distribution that provides the name, with its version, such as ``"dist 1.0"``.
        ways: Unambiguous names to request instead. Defaults to ``"dist:name"`` for each distribution.
    """

    def __init__(self, kind: str, name: str, distributions: Sequence[str], ways: Sequence[str] = ()) -> None:
        self.kind, self.name, self.distributions = kind, name, tuple(distributions)
        self.ways = tuple(ways) or tuple(f"{d.split()[0]}:{name}" for d in self.distributions)
        super().__init__(
            f"{kind} '{name}' is provided by {' and by '.join(self.distributions)}; "
            f"request {' or '.join(repr(way) for way in self.ways)}, or uninstall one of them."
        )


class ConfigurationError(FrobsError):
    """A setting or argument is invalid."""


class UnknownParameterError(ConfigurationError):
    """A keyword is not accepted.

    Args:
        owner: Object that does not accept the keyword, such as ``"task 'reach'"``.
        name: The keyword.
        available: The accepted keywords.
    """

    def __init__(self, owner: str, name: str, available: Iterable[str]) -> None:
        self.owner, self.name, self.available = owner, name, tuple(sorted(available))
        super().__init__(f"{owner} has no parameter '{name}'.{_hint(name, self.available)}")


def check_keys(owner: str, given: Iterable[object], available: Iterable[str], others: Iterable[str] = ()) -> None:
    """Raise :class:`UnknownParameterError` for the first keyword that is not available. For the arguments, see there.

    ``others`` are further keywords that the message may suggest.
    """
    known = tuple(available)
    for name in given:
        if name not in known:
            raise UnknownParameterError(owner, str(name), {*known, *others})


class ParameterValueError(ConfigurationError):
    """A value is outside the range that its parameter accepts.

    Args:
        name: Name of the parameter.
        value: The value that was passed.
        rule: Description of the valid values, such as ``"a whole number of at least 1"``.
        owner: Object that the parameter belongs to, such as ``"controller 'discrete'"``. Empty if the parameter's name
            is unambiguous.
    """

    def __init__(self, name: str, value: object, rule: str, owner: str = "") -> None:
        self.name, self.value, self.rule, self.owner = name, value, rule, owner
        shown = value.item() if getattr(value, "shape", None) == () else value  # type: ignore[attr-defined]
        super().__init__(f"{f'{owner}: ' if owner else ''}{name} is {shown!r}; it must be {rule}.")


class MissingSettingError(ConfigurationError):
    """A required setting is missing.

    Args:
        owner: Object that requires the setting, such as ``"algorithm 'ppo'"``.
        name: The missing setting.
        advice: How to provide the setting. Empty if the name is self-explanatory.
    """

    def __init__(self, owner: str, name: str, advice: str = "") -> None:
        self.owner, self.name, self.advice = owner, name, advice
        super().__init__(f"{owner} needs {name}{f'; {advice}' if advice else ''}.")


class ConflictingOptionsError(ConfigurationError):
    """Command-line options or settings cannot be combined.

    Args:
        options: Two or more options, as the user writes them.
        advice: What to do instead.
    """

    def __init__(self, options: Sequence[str], advice: str = "choose one") -> None:
        self.options, self.advice = tuple(options), advice
        super().__init__(f"{' and '.join(self.options)} cannot be combined; {advice}.")


class InvalidTimestepError(ConfigurationError):
    """``control_timestep`` is not a whole multiple of ``physics_timestep``.

    Args:
        control_timestep: [s]
        physics_timestep: [s]
    """

    def __init__(self, control_timestep: float, physics_timestep: float) -> None:
        self.control_timestep, self.physics_timestep = control_timestep, physics_timestep
        text = f"control_timestep {control_timestep} s is not a whole multiple of physics_timestep {physics_timestep} s"
        if control_timestep > 0 and physics_timestep > 0:
            steps = max(1, round(control_timestep / physics_timestep))
            text += f"; {steps * physics_timestep:.10g} s would work ({steps} physics steps)"
        else:
            text += "; both must be positive"
        super().__init__(text + ".")


class ConfigFileError(ConfigurationError):
    """A configuration file cannot be used.

    Args:
        path: The file.
        line: Line number, starting at 1, or None if unknown.
        reason: The problem and how to fix it.
    """

    def __init__(self, path: Path | str, line: int | None, reason: str) -> None:
        self.path, self.line, self.reason = Path(path), line, reason
        super().__init__(f"{path}{f':{line}' if line else ''}: {reason}")


class MissingDependencyError(ConfigurationError):
    """An optional package that a function requires is not installed.

    Args:
        purpose: Function that requires the packages, such as ``"the export to ONNX"``.
        packages: The packages.
        command: The command that installs them.
    """

    def __init__(self, purpose: str, packages: Sequence[str], command: str) -> None:
        self.purpose, self.packages, self.command = purpose, tuple(packages), local_install_hint(command)
        super().__init__(f"{purpose} needs {' and '.join(self.packages)}; install with: {self.command}")


class PhysicsParameterError(ConfigurationError):
    """A physical parameter has an invalid value or cannot be changed.

    Args:
        parameter: Name of the parameter, such as ``"mass"``.
        target: The link, body or robot, or an empty string for a parameter of the whole scene.
        reason: The problem.
    """

    def __init__(self, parameter: str, target: str, reason: str) -> None:
        self.parameter, self.target, self.reason = parameter, target, reason
        super().__init__(f"{parameter} of '{target}' {reason}" if target else f"{parameter} {reason}")


class SettingError(ConfigurationError):
    """A setting is invalid, such as one of a sensor or of the randomization.

    Args:
        place: Location of the setting, such as ``"sensors.lidar"`` or ``"randomize.mass[1].scale"``.
        reason: The problem and how to fix it.
    """

    _text = "{place}: {reason}"

    def __init__(self, place: str, reason: str) -> None:
        self.place, self.reason = place, reason
        super().__init__(self._text.format(place=place, reason=reason))


class ResetOptionError(SettingError):
    """A value in ``reset(options=…)`` is invalid. The ``place`` is the name of the option."""

    _text = "reset option '{place}' {reason}"
    option = renamed_attribute("option", "place")


class SceneError(SettingError):
    """A scene is inconsistent, or the simulator cannot build it. The ``place`` is a part, as in ``"contact 'grip'"``."""

    _text = "{place} {reason}"
    element = renamed_attribute("element", "place")


class UnsuitableRobotError(ConfigurationError):
    """A task, a controller or a tool cannot use this robot.

    Args:
        robot: Name of the robot.
        reason: The problem and how to fix it.
        owner: Object that cannot use the robot. Empty if the reason already names the object.
    """

    def __init__(self, robot: str, reason: str, owner: str = "") -> None:
        self.robot, self.reason, self.owner = robot, reason, owner
        super().__init__(f"{f'{owner}: ' if owner else ''}robot '{robot}' {reason}")


FLATTEN_HINT = "add the wrapper FlattenObservation: --set 'wrappers=[{name: gymnasium.wrappers:FlattenObservation}]'"
"""Advice for observation spaces that an algorithm does not support but that a wrapper can convert to a vector."""


class IncompatibleSpaceError(ConfigurationError):
    """An algorithm, a wrapper or a controller cannot use this observation or action space.

    Args:
        owner: Object that cannot use the space, such as ``"algorithm 'crossq'"``.
        space: The Gymnasium space.
        reason: The requirement and how to meet it.
    """

    def __init__(self, owner: str, space: object, reason: str) -> None:
        self.owner, self.space, self.reason = owner, space, reason
        super().__init__(f"{owner} {reason}")


class ModelMismatchError(ConfigurationError):
    """A trained model or run was made for a different environment.

    Args:
        model: The model's file, or a description of the model.
        name: The property that differs, such as ``"action_space"``.
        saved: The value that the model was trained with.
        found: The value of the environment.
    """

    def __init__(self, model: Path | str, name: str, saved: object, found: object) -> None:
        self.model, self.name, self.saved, self.found = model, name, saved, found
        super().__init__(f"{model} was trained with {name} {saved}, but the environment has {found}.")


class PolicyExportError(ConfigurationError):
    """A policy cannot be exported.

    Args:
        policy: The policy or the algorithm.
        reason: Which part is not supported.
    """

    def __init__(self, policy: str, reason: str) -> None:
        self.policy, self.reason = policy, reason
        super().__init__(f"{policy} cannot be exported: {reason}")


class CapabilityError(FrobsError):
    """The simulator does not support a capability that a task, a controller or the caller requires.

    Args:
        simulator: Name of the simulator.
        missing: One tuple for each unmet requirement: (requiring object, capability, required level, supported level).
    """

    def __init__(self, simulator: str, missing: Sequence[tuple[str, str, str, str]]) -> None:
        self.simulator, self.missing = simulator, tuple(missing)
        rows = [("needed by", "capability", "needed", f"{simulator} has"), *self.missing]
        widths = [max(len(row[i]) for row in rows) for i in range(4)]
        table = "\n".join(
            "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )
        super().__init__(
            f"simulator '{simulator}' cannot run this environment; choose another with simulator=…\n{table}"
        )

    @classmethod
    def lacking(cls, owner: object, capability: str) -> CapabilityError:
        """Return the error for a method that a simulator or one of its handles does not support.

        Args:
            owner: The simulation or the handle.
            capability: The unsupported capability.
        """
        return cls(type(owner).__name__, [("the caller", capability, "approximate", "unsupported")])


class ModelFileError(FrobsError):
    """A robot's model file cannot be used.

    Args:
        path: The file.
        reason: The problem and how to fix it.
        line: Line number, starting at 1, or None if unknown.
    """

    def __init__(self, path: Path | str, reason: str, line: int | None = None) -> None:
        if len(reason) > _LONGEST_REASON:  # a file from a stranger may contain names of any length
            reason = f"{reason[: _LONGEST_REASON // 2]} … {reason[-_LONGEST_REASON // 2 :]}"
        self.path, self.reason, self.line = Path(path), reason, line
        super().__init__(f"{path}{f':{line}' if line else ''}: {reason}")


class InvalidActionError(FrobsError):
    """An action has the wrong shape or is not finite."""


class ResetNeededError(FrobsError):
    """``step`` was called before ``reset``, or for an environment whose episode has ended."""


class EnvironmentCopyError(FrobsError, TypeError):
    """An environment cannot be copied or pickled. It is also a TypeError, as for other objects without copies.

    Args:
        reason: Why a copy is impossible.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"this environment cannot be copied or pickled: {reason}. Build each environment separately.")


class SimulationError(FrobsError):
    """The physics engine failed."""


class RenderingUnavailableError(SimulationError):
    """This machine cannot render images.

    Args:
        reason: What is missing.
        package: The Debian package that provides the missing library.
    """

    def __init__(self, reason: str, package: str) -> None:
        self.reason, self.package = reason, package
        super().__init__(f"cannot render: {reason}. Install the Debian package: apt-get install {package}")


class RunError(FrobsError):
    """A run folder cannot be used."""


class NonFiniteValueError(RunError):
    """A number is not finite, so training, evaluation or export cannot continue.

    Args:
        owner: Object that contains or returned the number.
        reason: The number and its location.
        fix: How to fix the problem.
    """

    def __init__(self, owner: str, reason: str, fix: str) -> None:
        self.owner, self.reason, self.fix = owner, reason, fix
        super().__init__(f"{owner} {reason}; {fix}.")


class CheckpointError(RunError):
    """A checkpoint cannot be written or read."""


class UntrustedFileError(FrobsError):
    """Opening the file would execute code that it contains, import modules, or open other files.

    Args:
        path: The file.
        reason: The part of the file that makes the file unsafe to open.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path, self.reason = Path(path), reason
        super().__init__(f"{path}: {reason}; if you trust the source of this file, pass --trust or trust=True.")
