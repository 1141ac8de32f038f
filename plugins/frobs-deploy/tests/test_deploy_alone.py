"""A bundle runs where nothing but NumPy and onnxruntime is installed."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest
from bundles import write_seeing

import frobs_deploy

PACKAGE = Path(frobs_deploy.__file__).parent
DISTRIBUTION = PACKAGE.parents[1]
ROOT = DISTRIBUTION.parents[1]

ACT = """
import sys
import numpy as np
import frobs_deploy
policy = frobs_deploy.Policy(sys.argv[1])
print(policy.act(np.array([0.25, -0.5, 9.0], np.float32)).tolist())
print(*sorted({name.partition('.')[0] for name in sys.modules}))
"""


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A folder of packages: NumPy, onnxruntime with what it needs, and frobs_deploy, as links."""
    folder = tmp_path / "packages"
    folder.mkdir()
    names = {"numpy", "onnxruntime", "flatbuffers", "protobuf", "packaging"}
    tops = {
        Path(str(file)).parts[0] for name in names for file in distribution(name).files or () if ".." not in str(file)
    }
    base = Path(str(distribution("numpy").locate_file("")))
    for top in tops - {"__pycache__"}:
        (folder / top).symlink_to(base / top)
    (folder / "frobs_deploy").symlink_to(PACKAGE)
    return folder


def python(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python without any package but those of a folder."""
    command = [sys.executable, "-S", "-W", "error", *arguments]
    environment = {"PYTHONPATH": str(folder), "PATH": ""}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)


def test_a_bundle_runs_without_torch_gymnasium_and_the_rest(bare: Path, arm: Path) -> None:
    done = python(bare, "-c", ACT, str(arm))
    assert done.stderr == ""
    action, modules = done.stdout.splitlines()
    np.testing.assert_array_equal(np.array(eval(action)), [0.25, -0.5])
    absent = {
        "torch",
        "gymnasium",
        "frobs_core",
        "pluggy",
        "pydantic",
        "yaml",
        "onnx",
        "stable_baselines3",
        "typer",
        "xacro",
    }
    assert absent & set(modules.split()) == set()
    for name in absent:
        assert python(bare, "-c", f"import {name}").returncode != 0


def test_the_module_says_what_a_bundle_is_for(bare: Path, arm: Path) -> None:
    done = python(bare, "-m", "frobs_deploy", str(arm), "--bench", "10")
    assert done.stderr == ""
    assert "joints            shoulder, elbow" in done.stdout
    assert "over 10 actions" in done.stdout
    broken = arm.with_name("broken.frobs")
    broken.write_bytes(b"PK")
    done = python(bare, "-m", "frobs_deploy", str(broken))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"error: {broken}: the file is damaged")
    assert done.stderr.count("\n") == 1


def test_a_policy_that_sees_runs_without_the_rest_and_says_what_it_sees(bare: Path, tmp_path: Path) -> None:
    path = write_seeing(tmp_path / "eye.frobs")
    act = "import sys, numpy as np, frobs_deploy; policy = frobs_deploy.Policy(sys.argv[1]); "
    act += "print(policy.act({'eye': np.full((2, 3, 3), 51, np.uint8)}).tolist())"
    done = python(bare, "-c", act, str(path))
    assert done.stderr == ""
    assert json.loads(done.stdout) == pytest.approx([0.2])
    done = python(bare, "-m", "frobs_deploy", str(path), "--bench", "10")
    assert done.stderr == ""
    assert "eye from camera 'wrist', rgb, 2 × 3 × 3 uint8, 0 to 255, with the task's markers drawn\n" in done.stdout


def test_without_onnxruntime_the_error_says_what_to_install(bare: Path, arm: Path) -> None:
    (bare / "onnxruntime").unlink()
    done = python(bare, "-m", "frobs_deploy", str(arm))
    assert (
        done.stderr == "error: running a policy bundle needs onnxruntime; install it with 'pip install onnxruntime'.\n"
    )


@pytest.mark.slow
def test_a_bundle_runs_in_a_virtual_environment_of_its_own(arm: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    interpreter = str(tmp_path / "venv" / "bin" / "python")
    pip = [interpreter, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    done = subprocess.run(
        [*pip, "-c", ROOT / "constraints.txt", "numpy", "onnxruntime"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    subprocess.run([*pip, "--no-deps", DISTRIBUTION], check=True)
    ran = subprocess.run([interpreter, "-c", ACT, arm], capture_output=True, text=True, cwd=tmp_path)
    assert ran.stderr == ""
    assert ran.stdout.splitlines()[0] == "[0.25, -0.5]"
    assert importlib.util.find_spec("torch") is not None  # here, and not there
    assert "torch" not in ran.stdout
