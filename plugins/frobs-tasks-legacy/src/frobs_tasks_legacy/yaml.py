"""Reader for FRobs_RL's task YAML files, which contain all values under one root key."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias

from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownNameError, nearest
from frobs_core.util.yaml import find_origin, load_yaml

Readers: TypeAlias = Mapping[str, Callable[[str, Any], Any]]
"""For each key, a function that takes the key and a value, validates the value, and returns the converted value."""


@dataclass(frozen=True, kw_only=True)
class TaskFiles:
    """Task YAML files of one kind of FRobs_RL task.

    Attributes:
        folder: Folder of this package that contains FRobs_RL's original values in ``tasks/NAME.yaml``.
        kind: Description of the named tasks, used in error messages.
        roots: Root key of each file, by file name without extension.
        used: Functions that validate and convert the values, by key.
        ignored: Keys in the files that have no effect.
    """

    folder: str
    kind: str
    roots: Mapping[str, str]
    used: Readers
    ignored: Sequence[str]

    def read(self, name: str, config_file: str | Path | None, keywords: Mapping[str, Any]) -> dict[str, Any]:
        """Return the value of each key that the task uses.

        The keywords take precedence over the file, and the file takes precedence over FRobs_RL's original file.

        Args:
            name: Name of the task, one of :attr:`roots`.
            config_file: Task YAML file of FRobs_RL, or None to use only FRobs_RL's original values.
            keywords: Values by key. Values of None and unused keys are ignored.

        Raises:
            ConfigFileError: The file cannot be read, or it contains an unknown key or an invalid value. The message
                includes the file name, the line number and the most similar valid key.
            ConfigurationError: A keyword has an invalid value.
            UnknownNameError: No task has this name.
        """
        if name not in self.roots:
            raise UnknownNameError(self.kind, name, self.roots)
        own = Path(str(files("frobs_tasks_legacy"))) / self.folder / "tasks" / f"{name}.yaml"
        paths = (own,) if config_file is None else (own, config_file)
        return self.read_files(paths, self.roots[name], keywords)

    def read_files(self, paths: Iterable[str | Path], root: str, keywords: Mapping[str, Any]) -> dict[str, Any]:
        """Return values as :meth:`read`, from files with the key ``root``. Later files take precedence."""
        values: dict[str, Any] = {}
        for path in paths:
            values |= self._read_section(path, root)
        return values | {
            name: check(name, keywords[name]) for name, check in self.used.items() if keywords.get(name) is not None
        }

    def _read_section(self, path: str | Path, root: str) -> dict[str, Any]:
        document = load_yaml(path)
        for key in document:
            if key != root:
                raise ConfigFileError(
                    path, _line(document, key), f"unknown key '{key}'; the file must contain '{root}:'."
                )
        section = document.get(root)
        if not isinstance(section, Mapping):
            raise ConfigFileError(path, _line(document, root), f"must contain a mapping under '{root}:'.")
        values = {}
        for key, value in section.items():
            if key in self.used:
                try:
                    values[key] = self.used[key](key, value)
                except ConfigurationError as error:
                    raise ConfigFileError(path, _line(section, key), str(error)) from error
            elif key not in self.ignored:
                known = [*self.used, *self.ignored]
                suggestion = nearest(str(key), known)
                hint = f" Did you mean '{suggestion}'?" if suggestion else ""
                text = f"unknown key '{key}'.{hint} Known: {', '.join(known)}."
                raise ConfigFileError(path, _line(section, key), text)
        return values


def _line(mapping: Mapping[str, Any], key: str) -> int | None:
    origin = find_origin(mapping, [key])
    return None if origin is None else origin[1]
