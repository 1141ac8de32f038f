"""Read configuration files, and translate files whose layout a plugin declares in a record."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from frobs_core import plugins
from frobs_core.deprecation import warn_deprecated
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigFileError
from frobs_core.util.install_hints import local_install_hint
from frobs_core.util.yaml import ConfigMapping, load_yaml
from frobs_train.configuration.layout_record import ConfigLayoutRecord

_log = logging.getLogger("frobs")


def read_config_file(file: Path | str, algorithm: str | None = None) -> tuple[ConfigMapping, bool]:
    """Read a YAML file, and translate the settings if a plugin's record declares the layout of the file.

    Settings that have no equivalent in FRobs are reported in a single warning. The result is the settings with the keys
    of :class:`frobs_train.RunConfig`, and whether the file was translated.
    """
    mapping = load_yaml(file)
    known = list(_layouts())
    layouts = {layout.algorithm: layout for layout in known if _has(mapping, layout.key)}
    if not layouts:
        if "model_params" in mapping and not any(layout.key.startswith("model_params.") for layout in known):
            hint = local_install_hint("pip install frobs-rl-compat")
            raise ConfigFileError(file, None, f"the file has the layout of FRobs_RL; to read it: {hint}.")
        return mapping, False
    if algorithm is None and len(layouts) > 1:
        raise ConfigFileError(
            file, None, f"several algorithms use this file layout: {', '.join(layouts)}; choose one with --algorithm."
        )
    name = algorithm or next(iter(layouts))
    if name not in layouts:
        raise ConfigFileError(
            file, None, f"the file has the layout of {', '.join(layouts)}, not of '{name}'; omit --algorithm."
        )
    settings, note = layouts[name].load()(mapping, name, Path(file))
    if note:
        _log.warning(note)
    return ConfigMapping(settings), True


def _layouts() -> Iterator[ConfigLayoutRecord]:
    """Yield the layouts of all plugins, and those that plugins of version 0.2 declare in the records of algorithms."""
    yield from plugins.records(ConfigLayoutRecord).values()
    for name, record in plugins.records(AlgorithmRecord).items():
        for key, function in record.config_files.items():
            instead = "a frobs_train.ConfigLayoutRecord from the hook frobs_extensions"
            warn_deprecated(f"config_files of the algorithm '{name}'", instead=instead, since="0.3", removed_in="0.4")
            yield ConfigLayoutRecord(name=name, summary="", entry_point=function, key=key, algorithm=name)


def _has(mapping: Any, key: str) -> bool:
    for part in key.split("."):
        if not isinstance(mapping, Mapping) or part not in mapping:
            return False
        mapping = mapping[part]
    return True
