"""Reading the task YAML of FRobs_RL: all values are under one key, and some have no meaning in FRobs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias

from frobs_core.errors import ConfigFileError, ConfigurationError, UnknownNameError, nearest
from frobs_core.yaml import find_origin, load_yaml

Readers: TypeAlias = Mapping[str, Callable[[str, Any], Any]]
"""Used keys, each with a function that validates and converts the value, given key and value."""


@dataclass(frozen=True, kw_only=True)
class TaskFiles:
    """The task YAML of one kind of FRobs_RL's tasks.

    Attributes:
        folder: Folder of this package whose ``tasks/NAME.yaml`` contains FRobs_RL's own values.
        kind: What a name denotes, for messages.
        roots: Root key of the files, by name.
        used: Keys that are used.
        ignored: Keys of such files that have no effect.
    """

    folder: str
    kind: str
    roots: Mapping[str, str]
    used: Readers
    ignored: Sequence[str]

    def read(self, name: str, config_file: str | Path | None, keywords: Mapping[str, Any]) -> dict[str, Any]:
        """Return a value for each used key: from the keyword, else from the file, else FRobs_RL's own.

        Args:
            name: Name from :attr:`roots`.
            config_file: An unchanged task YAML of FRobs_RL; None: no file.
            keywords: Values by key; None means not given, and other keys are ignored.

        Raises:
            ConfigFileError: The file cannot be read, or has an unknown key or an invalid value; names file and line.
            ConfigurationError: A keyword has an invalid value.
            UnknownNameError: The name does not exist.
        """
        if name not in self.roots:
            raise UnknownNameError(self.kind, name, self.roots)
        own = Path(str(files("frobs_tasks_legacy"))) / self.folder / "tasks" / f"{name}.yaml"
        paths = (own,) if config_file is None else (own, config_file)
        return read_values(paths, self.roots[name], self.used, self.ignored, keywords)


def read_values(
    paths: Iterable[str | Path], root: str, used: Readers, ignored: Sequence[str], keywords: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the values that keywords or files give, by key.

    Args:
        paths: The files; a later one takes precedence.
        root: Root key of the files.
        used: Keys that are used.
        ignored: Keys of such files that have no effect.
        keywords: Values by key, which take precedence over the files; None means not given, and other keys are ignored.

    Raises:
        ConfigFileError: A file cannot be read, or has an unknown key or an invalid value; names file, line and nearest
            key.
        ConfigurationError: A keyword has an invalid value.
    """
    values: dict[str, Any] = {}
    for path in paths:
        values |= _read_section(path, root, used, ignored)
    return values | {
        name: check(name, keywords[name]) for name, check in used.items() if keywords.get(name) is not None
    }


def _read_section(path: str | Path, root: str, used: Readers, ignored: Sequence[str]) -> dict[str, Any]:
    document = load_yaml(path)
    for key in document:
        if key != root:
            raise ConfigFileError(path, _line(document, key), f"unknown key '{key}'; the file must contain '{root}:'.")
    section = document.get(root)
    if not isinstance(section, Mapping):
        raise ConfigFileError(path, _line(document, root), f"must contain a mapping under '{root}:'.")
    values = {}
    for key, value in section.items():
        if key in used:
            try:
                values[key] = used[key](key, value)
            except ConfigurationError as error:
                raise ConfigFileError(path, _line(section, key), str(error)) from error
        elif key not in ignored:
            known = [*used, *ignored]
            suggestion = nearest(str(key), known)
            hint = f" Did you mean '{suggestion}'?" if suggestion else ""
            raise ConfigFileError(path, _line(section, key), f"unknown key '{key}'.{hint} Known: {', '.join(known)}.")
    return values


def _line(mapping: Mapping[str, Any], key: str) -> int | None:
    origin = find_origin(mapping, [key])
    return None if origin is None else origin[1]
