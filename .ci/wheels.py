"""Build every distribution as a wheel and an sdist in ``dist/``, check them, and install them in new environments.

For each Python that FRobs supports, it installs each distribution alone and all of them together, and tries what can be
tried with what is installed: imports, plugins, ``frobs``, a step of an environment, a short training run::

    $ python .ci/wheels.py                    # on each supported Python that this machine has
    $ python .ci/wheels.py --require-all      # a missing Python is an error
    $ python .ci/wheels.py --build-only
    $ python .ci/wheels.py --python 3.11 --only frobs-core frobs-cli

The wheels of other projects are kept in ``build/wheelhouse``, and each environment is installed from there, without network.
For the CPU build of PyTorch, set ``PIP_EXTRA_INDEX_URL`` to the index that PyTorch's installation page names.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from package_checks import metadata, problems
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
DIST = ROOT / "dist"
WHEELHOUSE = ROOT / "build" / "wheelhouse"
CONSTRAINTS = ROOT / "constraints.txt"
PYTHONS = ("3.11", "3.12", "3.13")
ID = "frobs/Irb120Reach-v0"
WORKERS = len(os.sched_getaffinity(0))


class CheckError(Exception):
    """A command failed, or a file is not as it must be."""


@dataclass(frozen=True)
class Built:
    """A distribution that was built.

    Attributes:
        name: Its name on a package index.
        wheel: The wheel.
        sdist: The source distribution.
    """

    name: str
    wheel: Path
    sdist: Path

    def packages(self) -> list[str]:
        """Return the import packages in the wheel."""
        names = {Path(name).parts[0] for name in zipfile.ZipFile(self.wheel).namelist()}
        return sorted(name for name in names if not name.endswith(".dist-info"))

    def requirements(self) -> list[str]:
        """Return the names of what it always requires."""
        lines = map(Requirement, metadata(self.wheel).get_all("Requires-Dist", []))
        return [line.name for line in lines if line.marker is None or "extra" not in str(line.marker)]


def run(
    command: Sequence[object],
    timeout: float = 1800,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
) -> None:
    """Run a command.

    Raises:
        CheckError: It fails; the message has the last lines of its output.
    """
    words = [str(word) for word in command]
    done = subprocess.run(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=timeout,
        cwd=cwd,
        env=env,
        check=False,
    )
    if done.returncode:
        raise CheckError("\n".join([" ".join(words), *done.stdout.splitlines()[-15:]]))


def build() -> dict[str, Built]:
    """Build each distribution into ``dist/``: the sdist first, and the wheel from it."""
    shutil.rmtree(DIST, ignore_errors=True)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", DIST]
    with ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(lambda project: run([*command, project]), projects()))
    return find_built()


def projects() -> list[Path]:
    """Return the folders of all distributions."""
    return [ROOT, *sorted(file.parent for file in ROOT.glob("plugins/*/pyproject.toml"))]


def find_built() -> dict[str, Built]:
    """Return the distributions in ``dist/`` by name."""
    found = {}
    for wheel in sorted(DIST.glob("*.whl")):
        stem = "-".join(wheel.name.split("-")[:2])
        name = metadata(wheel)["Name"]
        found[name] = Built(name, wheel, DIST / f"{stem}.tar.gz")
    if len(found) != len(projects()):
        raise CheckError(f"There are {len(projects())} distributions, but dist/ has {len(found)} wheels.")
    return found


def check(built: Mapping[str, Built], with_pages: bool) -> None:
    """Check the files as an index does, and what only we can know."""
    run([sys.executable, "-m", "twine", "check", "--strict", *sorted(DIST.iterdir())])
    found = [line for one in built.values() for line in problems(one.wheel, one.sdist)]
    if with_pages and "frobs_view/page_files/app.js" not in zipfile.ZipFile(built["frobs-view"].wheel).namelist():
        found.append("frobs-view: the files of static pages are missing; run 'make page' first")
    if found:
        raise CheckError("\n".join(found))


def find_python(version: str) -> Path | None:
    """Return an interpreter of a version that can make virtual environments, from PATH, pyenv or uv."""
    name = f"python{version}"
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    candidates = [Path(sys.executable), *(Path(folder) / name for folder in os.get_exec_path())]
    candidates += sorted(pyenv.glob(f"versions/{version}.*/bin/{name}"))
    candidates += sorted(Path.home().glob(f".local/share/uv/python/cpython-{version}.*/bin/{name}"))
    code = "import ensurepip, ssl, sys, venv; print('%d.%d' % sys.version_info[:2])"
    for candidate in candidates:
        if candidate.is_file():
            done = subprocess.run([candidate, "-c", code], capture_output=True, text=True, check=False)
            if done.stdout.strip() == version:
                return candidate
    return None


class Environments:
    """New virtual environments of one Python, installed from ``dist/`` and the wheelhouse alone.

    Args:
        python: The interpreter.
        built: All distributions.
        folder: Where the environments are.
    """

    def __init__(self, python: Path, built: Mapping[str, Built], folder: Path) -> None:
        self.python = python
        self.built = built
        self.folder = folder
        self.with_pip = folder / "pip"
        self.bases = {"frobs-core": folder / "base-core", "torch": folder / "base-torch"}

    def prepare(self) -> None:
        """Download what all distributions require, and make an environment with the core and another with PyTorch too.

        New environments begin as copies of these: most distributions require the core, and PyTorch is large.
        """
        run([self.python, "-m", "venv", self.with_pip])
        wheels = [one.wheel for one in self.built.values()]
        links = ["--find-links", DIST, "--find-links", WHEELHOUSE]
        options = ["--constraint", CONSTRAINTS, *links]
        try:
            self._pip(["install", "--dry-run", "--no-index", *options, *wheels])
        except CheckError:  # the wheelhouse is empty or outdated
            self._pip(["wheel", "--wheel-dir", WHEELHOUSE, *options, *wheels])
        for copy in WHEELHOUSE.glob("*frobs*"):
            copy.unlink(missing_ok=True)
        run([self.python, "-m", "venv", "--without-pip", self.bases["frobs-core"]])
        self.install(self.bases["frobs-core"], [self.built["frobs-core"].wheel])
        shutil.copytree(self.bases["frobs-core"], self.bases["torch"], symlinks=True)
        self.install(self.bases["torch"], ["torch"])

    def install(self, environment: Path, requirements: Sequence[object]) -> None:
        """Install into an environment, without network, and check that all requirements are met."""
        there = ["--python", environment / "bin" / "python"]
        offline = ["--no-index", "--find-links", DIST, "--find-links", WHEELHOUSE]
        self._pip([*there, "install", "--no-compile", "--constraint", CONSTRAINTS, *offline, *requirements])
        self._pip([*there, "check"])

    def new(self, name: str, required: Collection[str]) -> Path:
        """Return a new environment.

        Args:
            name: Name of its folder.
            required: What will be installed into it. If that includes PyTorch or the core, the environment is a
                hard-linked copy of one that has it.
        """
        environment = self.folder / name
        for requirement in ("torch", "frobs-core"):
            if requirement in required:
                shutil.copytree(self.bases[requirement], environment, symlinks=True, copy_function=os.link)
                return environment
        run([self.python, "-m", "venv", "--without-pip", environment])
        return environment

    def _pip(self, words: Sequence[object]) -> None:
        run([self.with_pip / "bin" / "python", "-m", "pip", "--no-input", "--disable-pip-version-check", *words])


def all_required(name: str, built: Mapping[str, Built]) -> set[str]:
    """Return the names of what a distribution requires, itself or through others of ours."""
    direct = built[name].requirements() if name in built else []
    return set(direct).union(*(all_required(other, built) for other in direct))


def try_alone(environments: Environments, built: Mapping[str, Built], name: str) -> str:
    """Install a distribution with its requirements into a new environment and try it; return a line about it."""
    start = time.monotonic()
    environment = environments.new(name, all_required(name, built))
    try:
        environments.install(environment, [built[name].wheel])
        smoke(environment, built[name].packages())
    except (CheckError, subprocess.TimeoutExpired) as error:
        return f"FAILED {name}: {error}"
    finally:
        shutil.rmtree(environment)
    return f"ok     {name} ({time.monotonic() - start:.0f} s)"


def try_together(environments: Environments, built: Mapping[str, Built]) -> str:
    """Install all distributions into one environment and try them; return a line about it."""
    start = time.monotonic()
    environment = environments.new("together", {"torch"})
    try:
        environments.install(environment, [one.wheel for one in built.values()])
        smoke(environment, ["--everything", *(package for one in built.values() for package in one.packages())])
        try_in(environment, ["frobs", "train", ID, "--steps", 2000, "--seed", 0, "--run-dir", environment / "run"])
    except (CheckError, subprocess.TimeoutExpired) as error:
        return f"FAILED all together: {error}"
    finally:
        shutil.rmtree(environment)
    return f"ok     all together: gym.make, step, training ({time.monotonic() - start:.0f} s)"


def smoke(environment: Path, arguments: Sequence[str]) -> None:
    """Import packages and load plugins; run ``frobs`` if it is installed."""
    try_in(environment, ["python", "-P", ROOT / ".ci" / "smoke.py", *arguments])
    if (environment / "bin" / "frobs").exists():
        try_in(environment, ["frobs", "--help"])
        try_in(environment, ["frobs", "list"])


def try_in(environment: Path, command: Sequence[object]) -> None:
    """Run a program of an environment outside the repository."""
    variables = {
        key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "FROBS", "VIRTUAL_ENV"))
    }
    run([environment / "bin" / str(command[0]), *command[1:]], timeout=300, cwd=environment, env=variables)


def on_python(python: Path, built: Mapping[str, Built], names: Sequence[str]) -> Iterator[str]:
    """Try distributions on one Python; yield a line about each."""
    with tempfile.TemporaryDirectory(prefix="frobs-wheels-", dir=DIST.parent / "build") as folder:
        environments = Environments(python, built, Path(folder))
        environments.prepare()
        with ThreadPoolExecutor(WORKERS) as pool:
            for done in as_completed([pool.submit(try_alone, environments, built, name) for name in names]):
                yield done.result()
        yield try_together(environments, built)


def main() -> int:
    """Build, check and try all distributions; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--build-only", action="store_true", help="build and check the files, and install nothing")
    parser.add_argument("--without-pages", action="store_true", help="accept a wheel without the files of static pages")
    parser.add_argument("--use-dist", action="store_true", help="build nothing, and try the files that are in dist/")
    parser.add_argument("--require-all", action="store_true", help="fail if one of the Pythons is not on this machine")
    parser.add_argument("--python", nargs="+", default=PYTHONS, metavar="VERSION", help="versions of Python to try")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="distributions to install alone (default: each)")
    arguments = parser.parse_args()

    start = time.monotonic()
    try:
        built = find_built() if arguments.use_dist else build()
        check(built, not arguments.without_pages)
    except CheckError as error:
        print(error, file=sys.stderr)
        return 1
    print(f"checked {len(built)} wheels and {len(built)} sdists in dist/ ({time.monotonic() - start:.0f} s)")
    if arguments.build_only:
        return 0
    unknown = set(arguments.only or ()) - set(built)
    if unknown:
        parser.error(f"no distribution is named {', '.join(sorted(unknown))}; there are {', '.join(built)}")

    WHEELHOUSE.mkdir(parents=True, exist_ok=True)
    failed, missing = False, []
    for version in arguments.python:
        python = find_python(version)
        if python is None:
            missing.append(version)
            continue
        print(f"\nPython {version} ({python})", flush=True)
        try:
            for line in on_python(python, built, arguments.only or sorted(built)):
                failed |= line.startswith("FAILED")
                print(f"  {line}", flush=True)
        except CheckError as error:
            failed = True
            print(f"  FAILED {error}", flush=True)
    print(f"\nfinished in {(time.monotonic() - start) / 60:.1f} minutes")
    if missing:
        print(f"not found on this machine, so not tried: Python {', '.join(missing)}")
    return int(failed or bool(missing and arguments.require_all))


if __name__ == "__main__":
    sys.exit(main())
