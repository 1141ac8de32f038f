"""The layers of FRobs: which distribution may import which; docs/explanation/architecture.md explains them."""

from __future__ import annotations

import sys
import zipfile
from fnmatch import fnmatch
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from layers import Distribution, distributions, imported_distributions, imports

CORE, MODELS, CLI, DEPLOY = "frobs-core", "frobs-models", "frobs-cli", "frobs-deploy"
ALGOS = "frobs-algos"
TRAIN, DEVKIT = "frobs-train", "frobs-devkit"

ALLOWED = {
    CORE: set(),
    DEPLOY: set(),
    MODELS: {CORE},
    CLI: {CORE, MODELS},
    TRAIN: {CORE, MODELS, CLI, DEPLOY},
    DEVKIT: {CORE, MODELS, CLI, DEPLOY, TRAIN},
    "frobs-sim-*": {CORE, MODELS},
    "frobs-grippers": {CORE, MODELS},
    "frobs-robots-*": {CORE, MODELS, "frobs-grippers"},
    "frobs-controllers*": {CORE, MODELS},
    "frobs-tasks-legacy": {CORE, "frobs-tasks-reach", "frobs-tasks-navigation"},
    "frobs-tasks-*": {CORE, MODELS},
    ALGOS: {CORE, "frobs-data"},
    "frobs-algos-sbx": {CORE, ALGOS, "frobs-algos-sb3"},
    "frobs-algos-*": {CORE, ALGOS},
    "frobs-data": {CORE, CLI, TRAIN},
    "frobs-view": {CORE, MODELS, CLI, TRAIN, DEVKIT},
    "frobs-ray": {CORE, ALGOS, TRAIN},
    "frobs-ros": {CORE, MODELS, CLI, DEPLOY},
    "frobs-ros2": {CORE, MODELS, CLI, DEPLOY},
    "frobs-rl-compat": {
        *(CORE, MODELS, CLI, "frobs-ros", "frobs-algos-sb3", "frobs-controllers-planning"),
        *("frobs-tasks-legacy", TRAIN, DEVKIT),
    },
    "lerobot_env_frobs": {CORE},
    "frobs": set(),
}
"""What each distribution may import; the first pattern that matches counts."""

REQUIRED_ONLY = {
    "frobs-rl-compat": {"frobs-tasks-legacy"},  # packages for FRobs_RL use its tasks by ID
    **{
        f"frobs-{name}": {MODELS}
        for name in ("grippers", *(f"robots-{of}" for of in ("abb", "franka", "kobuki", "so101", "ur")))
    },
}
"""Required without an import. Robots are model files, which frobs-models reads."""

OTHER_NAMES = {
    "PIL": "pillow",
    "coal": "pin",
    "mlflow": "mlflow-skinny",
    "collada": "pycollada",
    "pinocchio": "pin",
    "sbx": "sbx-rl",
    "yaml": "pyyaml",
}
"""Distributions whose import packages have another name."""

OPTIONAL = {
    DEVKIT: {"pytest", "stable_baselines3"},  # in the tests of plugins; a further checker of environments
    TRAIN: {"tensorboard"},  # event files are written if it is installed
    "frobs-rl-compat": {"gym", "rospkg"},  # its own replacement for gym; finds the packages that a configuration names
    "lerobot_env_frobs": {"lerobot"},  # which imports this distribution
}
"""Imports that no requirement covers: each is used only if it is installed."""

FROM_ROS = {"rclpy", "actionlib", "dynamic_reconfigure", "genmsg", "genpy", "rosgraph", "rosparam", "rospy"}
"""Modules of ROS 1 and ROS 2, besides those of messages and services."""

USED_BY_OTHERS = {
    ALGOS: {"onnxscript"},  # by torch.onnx
    "frobs-algos-sb3": {"tensorboard"},  # by stable-baselines3
    "frobs-algos-sbx": {"tfp-nightly"},  # by sbx
    TRAIN: {"alembic"},  # by MLflow, for a local database
    "frobs-ray": {"dm-tree", "lz4", "ormsgpack", "scipy"},  # by RLlib
    "frobs-ros2": {  # rclpy and message types, whose import packages have other names
        "ros-jazzy-nav-msgs",
        "ros-jazzy-rclpy",
        "ros-jazzy-rmw-fastrtps-cpp",
        "ros-jazzy-rosgraph-msgs",
        "ros-jazzy-sensor-msgs",
        "ros-jazzy-std-srvs",
        "ros-jazzy-trajectory-msgs",
    },
    "frobs-ros": {"defusedxml", "netifaces", "pycryptodomex", "python-gnupg", "rospkg"},  # by rospy
}
"""Requirements that a distribution does not import itself."""


def allowed(name: str) -> set[str]:
    return next(found for pattern, found in ALLOWED.items() if fnmatch(name, pattern))


def third_party(distribution: Distribution) -> set[str]:
    """Return the imported packages that are neither ours, nor Python's, nor ROS's."""
    ours = {package.name for other in distributions().values() for package in other.packages}
    known = ours | FROM_ROS | set(sys.stdlib_module_names)
    return {name for name in imports(distribution) if name not in known and not name.endswith(("_msgs", "_srvs"))}


def inherited(distribution: Distribution) -> set[str]:
    """Return all requirements of a distribution, with those of the distributions of this repository among them."""
    found = distribution.requirements()
    for name in found & set(distributions()):
        found = found | inherited(distributions()[name])
    return found


@pytest.fixture(params=distributions(), name="distribution")
def each_distribution(request: pytest.FixtureRequest) -> Distribution:
    return distributions()[request.param]


def test_a_distribution_imports_only_lower_layers(distribution: Distribution) -> None:
    forbidden = imported_distributions(distribution) - allowed(distribution.name)
    places = {name: sorted(imports(distribution).get(name.replace("-", "_"), ())) for name in sorted(forbidden)}
    assert not forbidden, f"{distribution.name} must not import {places}"


def test_a_distribution_requires_what_it_imports_of_frobs(distribution: Distribution) -> None:
    if not distribution.packages:
        pytest.skip("not applicable: the meta-package has no code")
    required = distribution.requirements() & set(distributions())
    assert required == imported_distributions(distribution) | REQUIRED_ONLY.get(distribution.name, set())


def test_algorithms_share_code_only_through_their_base() -> None:
    """The algorithms of sbx may also import those of stable-baselines3, whose classes sbx subclasses."""
    families = {name for name in distributions() if fnmatch(name, "frobs-algos-*") or name == "frobs-ray"}
    shared = {name: imported_distributions(distributions()[name]) & families - {name} for name in families}
    assert {name: found for name, found in shared.items() if found} == {"frobs-algos-sbx": {"frobs-algos-sb3"}}


def test_the_meta_package_requires_every_distribution_but_those_for_jax_and_ray() -> None:
    meta = distributions()["frobs"]
    assert meta.packages == ()
    assert meta.requirements() == set(distributions()) - {"frobs", "frobs-algos-sbx", "frobs-ray"}


def test_imported_libraries_are_required_here_or_below(distribution: Distribution) -> None:
    used = {
        OTHER_NAMES.get(name, name).replace("_", "-")
        for name in third_party(distribution) - OPTIONAL.get(distribution.name, set())
    }
    assert sorted(used - inherited(distribution)) == []


def test_required_libraries_are_imported(distribution: Distribution) -> None:
    used = {OTHER_NAMES.get(name, name).replace("_", "-") for name in third_party(distribution)}
    required = distribution.requirements() - set(distributions())
    assert sorted(required - used - USED_BY_OTHERS.get(distribution.name, set())) == []


def test_optional_imports_are_still_used() -> None:
    stale = {
        name: sorted(packages - third_party(distributions()[name]))
        for name, packages in OPTIONAL.items()
        if packages - third_party(distributions()[name])
    }
    assert stale == {}


def test_every_package_ships_its_types(distribution: Distribution, tmp_path: Path) -> None:
    if not distribution.packages:
        pytest.skip("not applicable: the meta-package has no code")
    missing = [package.name for package in distribution.packages if not (package / "py.typed").is_file()]
    assert not missing
    wheel = next(
        WheelBuilder(str(distribution.folder)).build(directory=str(tmp_path), versions=["standard"])
    )  # in a moment, without pip
    names = zipfile.ZipFile(wheel).namelist()
    assert {f"{package.name}/py.typed" for package in distribution.packages} <= set(names)
