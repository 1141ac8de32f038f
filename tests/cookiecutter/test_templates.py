"""The plain files are whole by themselves, and are what is rendered."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from sandbox import ROOT

from frobs_core.util.yaml import load_yaml
from frobs_train import resolve_config

TEMPLATES = ROOT / "templates"
FILES = sorted(path.name for path in TEMPLATES.glob("my_*.py"))
RENDERED = {
    "my_arm.py": ("robot", "arm", "robot.py"),
    "my_arm.urdf.xacro": ("robot", "arm", "my_arm.urdf.xacro"),
    "my_rover.py": ("robot", "wheeled", "robot.py"),
    "my_rover.urdf.xacro": ("robot", "wheeled", "my_rover.urdf.xacro"),
    "my_reach.py": ("task", "arm", "task.py"),
    "my_drive.py": ("both", "wheeled", "task.py"),
    "my_controller.py": ("controller", "", "controller.py"),
    "my_simulator.py": ("simulator", "", "simulator.py"),
}
"""What each file is rendered for, and as what."""


@pytest.mark.parametrize(
    "file", [pytest.param(name, marks=[] if name == "my_controller.py" else [pytest.mark.slow]) for name in FILES]
)
def test_a_template_checks_itself_when_it_is_run(file: str) -> None:
    command = [sys.executable, "-W", "error", TEMPLATES / file]
    done = subprocess.run(command, text=True, capture_output=True, timeout=300, cwd="/")
    assert done.returncode == 0, done.stderr
    statuses = [line.split()[0] for line in done.stdout.splitlines()]
    assert statuses.count("passed") >= 8, done.stdout
    assert set(statuses) <= {"passed", "not_applicable"}, done.stdout


@pytest.mark.parametrize("file", FILES)
def test_templates_use_public_modules_only(file: str) -> None:
    rooms = "contracts description models plugins plugins.hooks plugins.records util.arrays util.errors util.files"
    rooms += " util.plain util.random util.rotations util.validation"
    public = {f"frobs_core.{name}" for name in rooms.split()}
    for line in (TEMPLATES / file).read_text("utf-8").splitlines():
        module = line.split()[1] if line.strip().startswith("from frobs_core") else ""
        assert not module or module in public, line


@pytest.mark.parametrize("file", RENDERED)
def test_a_template_is_what_is_rendered(file: str, new: Any) -> None:
    what, example, name = RENDERED[file]
    answers = {"what": what, "name": file.partition(".")[0], **({"example": example} if example else {})}
    if file == "my_drive.py":  # the task's name is derived: my → my_drive
        answers["name"] = "my"
    (rendered,) = new(**answers).rglob(f"src/*/{name}")
    plain = (TEMPLATES / file).read_text("utf-8").partition('\n\nif __name__ == "__main__":')[0].rstrip("\n") + "\n"
    assert rendered.read_text("utf-8") == plain


def test_the_algorithm_is_what_is_rendered_without_its_record(new: Any) -> None:
    (rendered,) = new(what="algorithm", name="cross_entropy").rglob("src/*/algorithm.py")
    plain = (TEMPLATES / "algorithm.py").read_text("utf-8").splitlines()
    left_out = [line for line in plain if line and line not in rendered.read_text("utf-8").splitlines()]
    assert [line for line in rendered.read_text("utf-8").splitlines() if line not in plain] == []
    assert "from frobs_core.plugins.hooks import hookimpl" in left_out
    assert "def frobs_algorithms() -> list[AlgorithmRecord]:" in left_out
    assert len(left_out) < 25


def test_the_paced_simulator_is_what_is_rendered_without_its_record(new: Any) -> None:
    (rendered,) = new(what="simulator", name="my_paced_simulator", paced="yes").rglob("src/*/simulator.py")
    plain = (TEMPLATES / "my_paced_simulator.py").read_text("utf-8").splitlines()
    kept = rendered.read_text("utf-8").splitlines()
    assert [line for line in kept if line not in plain] == []
    left_out = [line for line in plain if line and line not in kept]
    assert "from frobs_core.plugins.records import Level, SimulatorRecord" in left_out
    assert 'if __name__ == "__main__" and len(sys.argv) == 2:  # the process of the world' in kept
    assert len(left_out) < 16


@pytest.mark.parametrize("file", sorted(path.name for path in TEMPLATES.glob("my_*.yaml")))
def test_a_configuration_can_be_resolved(file: str) -> None:
    loaded = load_yaml(TEMPLATES / file)
    if loaded["algorithm"] == "my_algorithm":
        assert set(loaded) == {"environment", "environment_kwargs", "algorithm", "num_envs", "steps"}
        return
    config = resolve_config(file=TEMPLATES / file)
    assert config.steps >= 100_000
    assert file in (TEMPLATES / file).read_text("utf-8").splitlines()[0]


def test_the_readme_names_every_template() -> None:
    text = (TEMPLATES / "README.md").read_text("utf-8")
    assert [path.name for path in sorted(TEMPLATES.iterdir()) if path.is_file() and f"`{path.name}`" not in text] == [
        "README.md"
    ]


def test_rendered_names_keep_their_spelling() -> None:
    sys.path.insert(0, str(ROOT / "cookiecutter"))
    try:
        from frobs_templates import renamed
    finally:
        sys.path.pop(0)
    text = "my_arm MY_ARM MyArm my-arm my_army"
    assert renamed(text, "my_arm", "x9_b") == "x9_b X9_B X9B x9-b x9_by"
    assert Path(renamed("my_arm.urdf", "my_arm", "a")).suffix == ".urdf"
