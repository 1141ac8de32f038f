"""A plugin of each kind as others would write it: public names only, its own wheel, and it works with the others'."""

from __future__ import annotations

import ast
import importlib
import json
import sys
from pathlib import Path

import pytest
from clean import FROBS, HERE, PLUGINS, ROOT, Environment, imports
from wheels import build_wheels, frobs_wheels

from frobs_core.deprecation import MOVED

sys.path.insert(0, str(ROOT / "docs"))
from generate import api

PUBLIC = {module for modules in api.MODULES.values() for module in modules}
PUBLIC |= MOVED.keys()  # the plugins are those of version 0.2

WORDS = {
    "acme-sim-ideal": (),
    "acme-robot-scara": (),
    "acme-controller-smooth": ("--simulator", "ideal"),
    "acme-task-touch": (),
    "acme-algo-climb": (),
}


def is_public(module: str, name: str) -> bool:
    """Return whether the documentation's reference lists a name of a module."""
    if module not in PUBLIC or name.startswith("_"):
        return False
    found = importlib.import_module(module)
    if module in MOVED:
        return hasattr(found, name)
    return name in (found.__all__ if hasattr(found, "__all__") else _defined(Path(found.__file__ or "")))


def _defined(path: Path) -> set[str]:
    """Return the names that a module defines itself."""
    names: set[str] = set()
    for node in ast.parse(path.read_text("utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names |= {target.id for target in targets if isinstance(target, ast.Name)}
    return names


@pytest.mark.filterwarnings("ignore::frobs_core.deprecation.FrobsDeprecationWarning")
@pytest.mark.parametrize("folder", PLUGINS, ids=lambda path: path.name)
def test_plugins_import_public_names_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FROBS_DEPRECATIONS")
    found = [(path.name, *one) for path in sorted(folder.rglob("*.py")) for one in imports(path)]
    assert found
    assert [one for one in found if not is_public(*one[1:])] == []


def test_there_is_one_of_each_kind() -> None:
    assert {path.name for path in PLUGINS} == WORDS.keys()


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Wheels of the core, of what its commands need, and of the plugins."""
    built = [*frobs_wheels(tmp_path_factory), *build_wheels(PLUGINS, tmp_path_factory.mktemp("wheels"))]
    found = {path.name.split("-")[0].replace("_", "-"): path for path in built}
    return {name: found[name] for name in ("frobs-core", *FROBS, *WORDS)}


@pytest.fixture(scope="module")
def clean(wheels: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Environment:
    environment = Environment(tmp_path_factory.mktemp("clean"))
    environment.install(*wheels.values())
    return environment


@pytest.mark.slow
def test_they_are_all_that_is_installed(clean: Environment) -> None:
    done = clean.frobs("doctor", "plugins", "--json")
    found = {facts["distribution"]: facts for facts in json.loads(done.stdout)["plugins"]}
    assert found.keys() == WORDS.keys() | {"frobs-models", "frobs-train"}
    codes = {name: {finding["code"] for finding in facts["findings"]} for name, facts in found.items()}
    of_version_0_2 = {"deprecated", "missing-requirement", "other-core"}
    assert codes == {"frobs-models": set(), "frobs-train": set()} | dict.fromkeys(WORDS, of_version_0_2)


@pytest.mark.slow
@pytest.mark.parametrize("distribution", WORDS)
def test_each_passes_the_kit(clean: Environment, distribution: str) -> None:
    done = clean.frobs("check", f"distribution:{distribution}", *WORDS[distribution], "--json")
    assert done.stdout, done.stderr
    report = json.loads(done.stdout)
    assert [(check["name"], check["message"]) for check in report["checks"] if check["status"] == "failed"] == []
    assert report["versions"][distribution] == "1.2.0"


@pytest.mark.slow
def test_they_work_together(clean: Environment) -> None:
    trained = clean.frobs("train", "acme/ScaraTouch-v0", "--algorithm", "climb", "--steps", "2000", "--run-dir", "run")
    assert trained.returncode == 0, trained.stdout + trained.stderr
    evaluated = clean.frobs("evaluate", "run", "--episodes", "5", "--json")
    assert evaluated.returncode == 0, evaluated.stderr
    assert json.loads(evaluated.stdout)["episodes"] == 5


@pytest.mark.slow
@pytest.mark.parametrize("gone", WORDS)
def test_without_any_one_of_them_the_others_work(clean: Environment, wheels: dict[str, Path], gone: str) -> None:
    clean.uninstall(gone)
    try:
        listed = clean.frobs("plugins", "--json")
        assert listed.returncode == 0, listed.stderr
        reports = json.loads(listed.stdout)["plugins"]
        states = {r["distribution"]: r["state"] for r in reports if r["distribution"].startswith("acme")}
        assert states == {d: "loaded" for d in WORDS if d != gone}
        made = clean.run(
            "-c", "import gymnasium as gym; env = gym.make('frobs_core:acme/ScaraTouch-v0'); env.reset(seed=0)"
        )
        if gone == "acme-algo-climb":
            assert made.returncode == 0, made.stderr
        else:
            name = {"acme-sim-ideal": "ideal", "acme-robot-scara": "scara", "acme-controller-smooth": "smooth"}.get(
                gone, "acme"
            )
            assert name in made.stderr.strip().splitlines()[-1], made.stderr  # one line that names what is missing
    finally:
        clean.install(wheels[gone])


EXTENSIONS = """
import gymnasium as gym
import numpy as np
from frobs_core.util.errors import CapabilityError
from frobs_core.util.random import RandomSource
from frobs_core.sensing.sensors import Sensors

keywords = {
    "robot": "scara_with_pointer",
    "sensors": {"wind": {"type": "anemometer", "frame": "pointer_point"}},
    "randomize": {"wind_speed": {"set": [1.0, 2.0]}},
}
env = gym.make("frobs_core:acme/ScaraTouch-v0", **keywords).unwrapped
assert env.robot.tcp == "pointer_point"
reach = np.linalg.norm(env.robot.frame_pose("tcp", np.zeros((1, 2)))[0][0, :2])
assert abs(reach - 0.54) < 1e-9, reach
speeds = set()
for seed in range(3):
    env.reset(seed=seed)
    sensors = Sensors(env.simulation, env.control_timestep)
    sensors.reset(None, RandomSource(1))
    wind = sensors.read("wind")[0]
    assert wind[0] == env.randomization.values["wind_speed/world"][0] and 1.0 <= wind[0] < 2.0 and not wind[1:].any()
    speeds.add(wind[0])
assert len(speeds) == 3
from frobs_core import plugins
plugins.get_record("simulator", "ideal").capabilities.pop("wind")
try:
    gym.make("acme/ScaraTouch-v0", **keywords)
except CapabilityError as error:
    assert "wind" in str(error)
else:
    raise AssertionError("a simulator without the capability was accepted")
print("done")
"""


@pytest.mark.slow
def test_plugins_add_an_ability_a_sensor_type_a_parameter_and_an_end_effector(clean: Environment) -> None:
    done = clean.run("-c", EXTENSIONS)
    assert done.stdout.strip().endswith("done"), done.stderr


def test_the_folder_of_each_is_small() -> None:
    for folder in PLUGINS:
        lines = sum(len(path.read_text("utf-8").splitlines()) for path in folder.rglob("*.py"))
        assert lines < 400, f"{folder.relative_to(HERE)} has {lines} lines"
