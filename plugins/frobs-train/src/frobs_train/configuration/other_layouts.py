"""Read configuration files, and translate files whose layout is declared in an algorithm's record."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from frobs_core import plugins
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigFileError
from frobs_core.util.yaml import ConfigMapping, load_yaml

_log = logging.getLogger("frobs")


def read_config_file(file: Path | str, algorithm: str | None = None) -> tuple[ConfigMapping, bool]:
    """Read a YAML file, and translate the settings if an algorithm's record declares the layout of the file.

    Settings that have no equivalent in FRobs are reported in a single warning.

    Returns:
        Settings with the keys of :class:`frobs_train.RunConfig`, and whether the file was translated.
    """
    mapping = load_yaml(file)
    found = {
        name: record.config_files[key]
        for name, record in cast("Mapping[str, AlgorithmRecord]", plugins.records("algorithm")).items()
        for key in record.config_files
        if _has(mapping, key)
    }
    if not found:
        return mapping, False
    if algorithm is None and len(found) > 1:
        raise ConfigFileError(
            file, None, f"several algorithms use this file layout: {', '.join(found)}; choose one with --algorithm."
        )
    name = algorithm or next(iter(found))
    if name not in found:
        raise ConfigFileError(
            file, None, f"the file has the layout of {', '.join(found)}, not of '{name}'; omit --algorithm."
        )
    module, _, function = found[name].partition(":")
    settings, note = getattr(import_module(module), function)(mapping, name, Path(file))
    if note:
        _log.warning(note)
    return ConfigMapping(settings), True


def _has(mapping: Any, key: str) -> bool:
    """Return whether the mapping of a file contains a dotted key."""
    for part in key.split("."):
        if not isinstance(mapping, Mapping) or part not in mapping:
            return False
        mapping = mapping[part]
    return True
