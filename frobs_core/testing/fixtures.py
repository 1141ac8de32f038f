"""A fixture of pytest for tests of plugins. To use it, say in ``conftest.py``::

    pytest_plugins = ["frobs_core.testing.fixtures"]
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.metadata import Distribution, PathNotFound
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from frobs_core import plugins
from frobs_core.plugins import Plugins
