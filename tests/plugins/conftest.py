"""A site of real distributions: modules with real dist-info folders, to be found as pip's are."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from importlib.metadata import distributions
from pathlib import Path
from textwrap import dedent

import pytest

from frobs_core.plugins import Plugins

HEADER = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import *
from frobs_core.plugins.records import EnvironmentRecord
"""


class Site:
    """A folder of installed distributions."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def add(
        self,
        distribution: str,
        modules: Mapping[str, str],
        *,
        version: str = "1.0",
        points: Mapping[str, str] | None = None,
        entry_points: str | None = None,
        requires: tuple[str, ...] = (),
    ) -> None:
        """Install a distribution.

        Args:
            distribution: Its name.
            modules: Source by path: ``{"pkg/__init__.py": …}`` or ``{"plugin_module.py": …}``.
            version: Its version.
            points: Module by entry point name; by default the first module, under its own name.
            entry_points: The text of ``entry_points.txt``, instead of ``points``.
            requires: What it depends on: ``("numpy>=2",)``.
        """
        info = self.path / f"{distribution.replace('-', '_')}-{version}.dist-info"
        info.mkdir()
        for name, source in modules.items():
            file = self.path / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(dedent(source))
        if points is None:
            first = next(iter(modules)).removesuffix(".py").replace("/", ".")
            points = {first: first}
        lines = [f"{name} = {module}" for name, module in points.items()]
        needs = "".join(f"Requires-Dist: {one}\n" for one in requires)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n{needs}")
        (info / "entry_points.txt").write_text(entry_points or "\n".join(["[frobs]", *lines, ""]))
        files = [*modules, *(f"{info.name}/{name}" for name in ("METADATA", "entry_points.txt", "RECORD"))]
        (info / "RECORD").write_text("".join(f"{file},,\n" for file in files))

    def add_robot(
        self, distribution: str, module: str, robot: str = "arm", version: str = "1.0", requires: tuple[str, ...] = ()
    ) -> None:
        """Install a distribution with a plugin, ``module``, that offers one robot."""
        self.add(distribution, {f"{module}.py": robots(robot)}, version=version, requires=requires)

    def plugins(self, **arguments: object) -> Plugins:
        """Return a fresh collection of what is installed here and nowhere else."""
        return Plugins(distributions(path=[str(self.path)]), **arguments)

    def python(self, code: str, **environment: str) -> subprocess.CompletedProcess[str]:
        """Run a new interpreter in which all this is installed beside the real plugins."""
        script = self.path / "the_script.py"
        script.write_text(dedent(code))
        return subprocess.run(
            [sys.executable, str(script)],
            env={**os.environ, "PYTHONPATH": str(self.path), **environment},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )


def robots(*names: str) -> str:
    """Return the source of a plugin that offers robots."""
    records = ", ".join(f"RobotRecord(name={name!r}, summary='s', entry_point='robots:ARM')" for name in names)
    return f"{HEADER}\n@hookimpl\ndef frobs_robots():\n    return [{records}]\n"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Site]:
    """An empty site, importable from this interpreter too."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    for variable in ("FROBS_STRICT_PLUGINS", "FROBS_DISABLE_PLUGINS"):
        monkeypatch.delenv(variable, raising=False)
    before = set(sys.modules)
    yield Site(folder)
    ours = {file.stem for file in folder.iterdir()}
    for name in set(sys.modules) - before:
        if name.partition(".")[0] in ours:
            del sys.modules[name]
