"""Finds the distribution that writes static pages of policies.

A distribution registers the function in the entry-point group ``frobs.pages``::

    [project.entry-points."frobs.pages"]
    acme-view = "acme_view.page:write_page"
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from frobs_core.util.errors import MissingDependencyError
from frobs_train.export.bundle_run import BundleRun

GROUP = "frobs.pages"

WritePage = Callable[[BundleRun, Path], dict[str, Any]]
"""Function that writes the page of a policy bundle to a folder, and returns facts about the page by name."""


def find_page_writer() -> WritePage:
    """Return the function that writes static pages, or raise MissingDependencyError if it is not installed."""
    for entry in entry_points(group=GROUP):
        writer: WritePage = entry.load()
        return writer
    raise MissingDependencyError("--page", ["frobs-view"], "pip install frobs-view")
