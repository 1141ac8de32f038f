"""Every error that FRobs raises on purpose.

    FrobsError
    ├── PluginError
    │   ├── PluginLoadError         a plugin cannot be imported or registered
    │   ├── UnknownNameError        no such simulator, robot, controller, task, algorithm, ID, …
    │   └── AmbiguousNameError      two distributions offer one name
    ├── ConfigurationError
    │   ├── UnknownParameterError   a keyword that nothing takes
    │   ├── InvalidTimestepError    control_timestep is no multiple of physics_timestep
    │   └── ConfigFileError         a YAML file that cannot be used; names file and line
    ├── CapabilityError             the simulator lacks what a task or controller needs
    ├── ModelFileError              a URDF, xacro or MJCF file that cannot be used
    ├── InvalidActionError          wrong shape, or not finite
    ├── ResetNeededError            step before reset, or after the episode's end
    ├── SimulationError             the engine failed
    │   └── RenderingUnavailableError   no OpenGL here
    ├── RunError
    │   └── CheckpointError         a checkpoint cannot be written or read
    └── UntrustedFileError          opening the file would execute code, or load what it names

Each takes the objects it is about, keeps them as fields, and writes its own text: what was asked,
what exists, what to do.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from pathlib import Path


def nearest(name: str, available: Iterable[str]) -> str | None:
    """Return the member of ``available`` that is most like ``name``, or None if none is close."""
    by_lower = {candidate.lower(): candidate for candidate in available}
    found = difflib.get_close_matches(name.lower(), by_lower, n=1, cutoff=0.5)
    return by_lower[found[0]] if found else None


def _hint(name: str, available: Sequence[str]) -> str:
    suggestion = nearest(name, available)
    text = f" Did you mean '{suggestion}'?" if suggestion else ""
    return f"{text} Available: {', '.join(available) if available else 'none'}."


class FrobsError(Exception):
    """Root of every error that FRobs raises on purpose."""


class PluginError(FrobsError):
    """A plugin, or a name that a plugin should offer, cannot be used."""


class PluginLoadError(PluginError):
    """A plugin cannot be imported or registered.

    Args:
        plugin: The entry point's name.
        distribution: The pip package that holds it, with its version.
        cause: One line that says why.
    """

    def __init__(self, plugin: str, distribution: str, cause: str) -> None:
        self.plugin = plugin
        self.distribution = distribution
        self.cause = cause
        super().__init__(f"plugin '{plugin}' of {distribution} did not load: {cause}")


class UnknownNameError(PluginError):
    """Nothing of this name exists.

    Args:
        kind: What was looked for: ``"robot"``, ``"controller"``, ``"environment ID"``, …
        name: The name that was asked for.
        available: The names that exist.
        failed: One line for each plugin that failed to load and might have offered the name.
        install_hint: The command that installs the name, where it is known.
    """

    def __init__(
        self,
        kind: str,
        name: str,
        available: Iterable[str],
        failed: Sequence[str] = (),
        install_hint: str = "",
    ) -> None:
        self.kind = kind
        self.name = name
        self.available = tuple(sorted(available))
        self.failed = tuple(failed)
        self.install_hint = install_hint
        text = f"no {kind} is named '{name}'.{_hint(name, self.available)}"
        if install_hint:
            text += f" To install it: {install_hint}."
        if self.failed:
            text += f" Plugins that failed to load: {'; '.join(self.failed)}."
        super().__init__(text)


class AmbiguousNameError(PluginError):
    """Two distributions offer one name.

    Args:
        kind: The kind of the name.
        name: The bare name that was asked for.
        distributions: Each distribution that offers it, with its version: ``"dist 1.0"``.
        ways: What to ask for instead; ``"dist:name"`` for each of them where nothing else is said.
    """

    def __init__(self, kind: str, name: str, distributions: Sequence[str], ways: Sequence[str] = ()) -> None:
        self.kind = kind
        self.name = name
        self.distributions = tuple(distributions)
        self.ways = tuple(ways) or tuple(f"{d.split()[0]}:{name}" for d in self.distributions)
        super().__init__(
            f"{kind} '{name}' is offered by {' and by '.join(self.distributions)}; "
            f"ask for {' or '.join(repr(way) for way in self.ways)}, or uninstall one of them."
        )


class ConfigurationError(FrobsError):
    """A value that was given cannot be used."""


class UnknownParameterError(ConfigurationError):
    """A keyword that nothing takes.

    Args:
        owner: What was built with it: ``"task 'reach'"``.
        name: The keyword.
        available: The keywords that exist.
    """

    def __init__(self, owner: str, name: str, available: Iterable[str]) -> None:
        self.owner = owner
        self.name = name
        self.available = tuple(sorted(available))
        super().__init__(f"{owner} takes no parameter '{name}'.{_hint(name, self.available)}")


class InvalidTimestepError(ConfigurationError):
    """``control_timestep`` is not a whole multiple of ``physics_timestep``.

    Args:
        control_timestep: [s]
        physics_timestep: [s]
    """

    def __init__(self, control_timestep: float, physics_timestep: float) -> None:
        self.control_timestep = control_timestep
        self.physics_timestep = physics_timestep
        text = f"control_timestep {control_timestep} s is not a whole multiple of physics_timestep {physics_timestep} s"
        if control_timestep > 0 and physics_timestep > 0:
            steps = max(1, round(control_timestep / physics_timestep))
            text += f"; {steps * physics_timestep:.10g} s would be ({steps} physics steps)"
        else:
            text += "; both must be positive"
        super().__init__(text + ".")


class ConfigFileError(ConfigurationError):
    """A configuration file cannot be used.

    Args:
        path: The file.
        line: 1-based line, or None where it is not known.
        reason: What is wrong and what to do.
    """

    def __init__(self, path: Path | str, line: int | None, reason: str) -> None:
        self.path = Path(path)
        self.line = line
        self.reason = reason
        super().__init__(f"{path}{f':{line}' if line else ''}: {reason}")


class CapabilityError(FrobsError):
    """The simulator lacks what a task, a controller or the caller needs.

    Args:
        simulator: Its name.
        missing: One row for each need: (who needs it, capability, level needed, level there is).
    """

    def __init__(self, simulator: str, missing: Sequence[tuple[str, str, str, str]]) -> None:
        self.simulator = simulator
        self.missing = tuple(missing)
        rows = [("needed by", "capability", "needed", f"{simulator} has"), *self.missing]
        widths = [max(len(row[i]) for row in rows) for i in range(4)]
        table = "\n".join(
            "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )
        super().__init__(
            f"simulator '{simulator}' cannot run this environment; choose another with simulator=…\n{table}"
        )


class ModelFileError(FrobsError):
    """A robot's model file cannot be used.

    Args:
        path: The file.
        reason: What is wrong and what to do.
        line: 1-based line, or None where it is not known.
    """

    def __init__(self, path: Path | str, reason: str, line: int | None = None) -> None:
        self.path = Path(path)
        self.reason = reason
        self.line = line
        super().__init__(f"{path}{f':{line}' if line else ''}: {reason}")


class InvalidActionError(FrobsError):
    """An action has the wrong shape or is not finite."""


class ResetNeededError(FrobsError):
    """``step`` was called before ``reset``, or for an environment whose episode has ended."""


class SimulationError(FrobsError):
    """The engine failed."""


class RenderingUnavailableError(SimulationError):
    """No picture can be drawn on this machine.

    Args:
        reason: What is missing.
        package: The Debian package that brings it.
    """

    def __init__(self, reason: str, package: str) -> None:
        self.reason = reason
        self.package = package
        super().__init__(f"no picture can be drawn: {reason}; install it with 'apt-get install {package}'.")


class RunError(FrobsError):
    """A run folder cannot be used."""


class CheckpointError(RunError):
    """A checkpoint cannot be written or read."""


class UntrustedFileError(FrobsError):
    """Opening the file would execute code that it holds, or import or open what it names.

    Args:
        path: The file.
        reason: Which part of it would.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}; if you trust where it comes from, say --trust or trust=True.")
