"""Adds the templates of ``frobs new``, which are two folders of the repository, to the sdist and the wheel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class TemplatesHook(BuildHookInterface):  # type: ignore[type-arg]
    """Copies the templates into the package; an sdist already has them there."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the folders to copy."""
        target = "frobs_devkit/scaffold/files"
        if self.target_name == "sdist":
            target = f"src/{target}"
        elif Path(self.root, "src", target).is_dir():
            return
        for name in ("cookiecutter", "templates"):
            build_data["force_include"][str(Path(self.root).parents[1] / name)] = f"{target}/{name}"
