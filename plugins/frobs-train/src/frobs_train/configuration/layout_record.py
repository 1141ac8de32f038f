"""Record of another layout of configuration files. Plugins import this module when they are loaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from frobs_core.plugins.records import Record


@dataclass(frozen=True, kw_only=True)
class ConfigLayoutRecord(Record):
    """Record of a YAML layout for ``frobs train --config``, which a plugin provides with the hook ``frobs_extensions``.

    ``entry_point`` names a function. The function receives the mapping read from the file, the algorithm's name and the
    path. It returns run configuration keys and a one-line message about settings without an equivalent.

    Attributes:
        key: Dotted path of the setting by which a file of the layout is recognized.
        algorithm: Name of the algorithm whose settings such a file contains.
    """

    kind: ClassVar[str] = "config_layout"

    key: str
    algorithm: str
