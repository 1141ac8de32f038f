"""A policy bundle names registered things, listed wrappers and plain data; whatever else it names needs trust."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from typer.testing import CliRunner

from frobs_cli.program import program
from frobs_core.util.errors import ConfigurationError, FrobsError, UntrustedFileError
from frobs_deploy import BundleError, DeployError, read_bundle
from frobs_deploy.bundle import Bundle, pack_bundle
from frobs_train import evaluate
from frobs_train.export.bundle_run import BundleRun, open_run_or_bundle
from frobs_train.export.pretrained import read_pretrained
from frobs_train.export.untrusted import WRAPPERS

REACH = "frobs/Irb120Reach-v0"

REFUSED: dict[str, dict[str, Any]] = {
    "a module": {"environment": "os:CartPole-v1"},
    "a module of the package": {"environment": "frobs_devkit.testing:CartPole-v1"},
    "a module that is made up": {"environment": f"made.up:{REACH}"},
    "a robot by file": {"environment_kwargs": {"robot": "PATH/evil.urdf.xacro"}},
    "a robot by file in the working directory": {"environment_kwargs": {"robot": "evil.urdf"}},
    "a robot by file, in capitals": {"environment_kwargs": {"robot": "EVIL.URDF"}},
    "a robot of a package": {"environment_kwargs": {"robot": "frobs_robots_abb:models/irb120.urdf.xacro"}},
    "a robot in the parent": {"environment_kwargs": {"robot": "../evil"}},
    "a robot as a mapping": {"environment_kwargs": {"robot": {"model": "evil.urdf"}}},
    "a task by path": {"environment_kwargs": {"task": "./reach"}},
    "a simulator by import name": {"environment_kwargs": {"simulator": "package.module:Name.py"}},
    "folders of packages": {"environment_kwargs": {"package_paths": {"a": "b"}}},
    "an argument that is a path": {"environment_kwargs": {"xacro_args": {"file": "/etc/passwd"}}},
    "an argument that is a file": {"environment_kwargs": {"xacro_args": {"file": "evil.yaml"}}},
    "an argument that is evaluated": {"environment_kwargs": {"xacro_args": {"a": "$(find x)"}}},
    "a key that is a path": {"environment_kwargs": {"home": {"../a": 1.0}}},
    "a path in a list": {"environment_kwargs": {"sensors": {"lidar": ["a", ["~/b"]]}}},
    "a file of another environment": {"environment": "Ant-v5", "environment_kwargs": {"xml_file": "evil.xml"}},
    "images that fill the memory": {
        "environment_kwargs": {
            "observations": {f"eye_{i}": {"camera": "overview", "size": [2048, 2048]} for i in range(2)}
        }
    },
    "a camera by path": {"environment_kwargs": {"observations": {"eye": {"camera": "/dev/video0"}}}},
    "a path in the randomization": {"randomize": {"mass": {"range": "/etc/passwd"}}},
    "a recorder": {"wrappers": [{"name": "gymnasium.wrappers:RecordVideo", "video_folder": "made"}]},
    "a wrapper by another way": {
        "wrappers": [{"name": "gymnasium.wrappers.rendering:RecordVideo", "video_folder": "m"}]
    },
    "a wrapper of one's own": {"wrappers": [{"name": "evil.module:Wrapper"}]},
    "a function": {"wrappers": [{"name": "os:system", "command": "touch made"}]},
    "a function of a wrapper": {"wrappers": [{"name": "gymnasium.wrappers:TransformReward", "func": "os:system"}]},
    "a wrapper with a path": {"wrappers": [{"name": "gymnasium.wrappers:ClipReward", "min_reward": "/tmp/x"}]},
    "stacked frame wrappers": {
        "wrappers": [{"name": "gymnasium.wrappers:FrameStackObservation", "stack_size": 90}] * 3
    },
    "stacked images": {
        "environment_kwargs": {"observations": {"eye": {"camera": "overview", "size": [512, 512]}}},
        "wrappers": [{"name": "gymnasium.wrappers:FrameStackObservation", "stack_size": 50}],
    },
    "stacked delays": {"wrappers": [{"name": "gymnasium.wrappers:DelayObservation", "delay": 1000}]},
    "stacked skips": {"wrappers": [{"name": "gymnasium.wrappers:MaxAndSkipObservation", "skip": 30}] * 3},
    "usual skips, stacked": {"wrappers": [{"name": "gymnasium.wrappers:MaxAndSkipObservation"}] * 30},
    "a huge image": {"wrappers": [{"name": "gymnasium.wrappers:ResizeObservation", "shape": [20_000, 20_000]}]},
    "a huge video": {"environment_kwargs": {"render_size": [100_000, 100_000]}},
    "another huge video": {"environment": "Ant-v5", "environment_kwargs": {"width": 100_000, "height": 100_000}},
    "a huge map": {"environment": "FrozenLake-v1", "environment_kwargs": {"desc": ["SF" + "F" * 1998] * 2000}},
    "many values": {"environment_kwargs": {"home": [0.0] * 100_000}},
    "many physics steps": {"environment_kwargs": {"control_timestep": 20}},
    "endless physics steps": {"environment_kwargs": {"control_timestep": 1e300, "physics_timestep": 1e-300}},
    "many skipped frames": {"environment": "Ant-v5", "environment_kwargs": {"frame_skip": 10**9}},
    "long episodes": {"environment_kwargs": {"max_episode_steps": 10**400}},
    "endless episodes": {"environment_kwargs": {"max_episode_steps": 1e18}},
    "long episodes by a wrapper": {"wrappers": [{"name": "gymnasium.wrappers:TimeLimit", "max_episode_steps": 10**9}]},
    "a long training": {"steps": 10**400},
    "a long seed": {"seed": 10**400},
    "a wrapper of a billion frames": {
        "wrappers": [{"name": "gymnasium.wrappers:FrameStackObservation", "stack_size": 10**9}]
    },
}
ALLOWED: dict[str, dict[str, Any]] = {
    "nothing": {},
    "the package of the IDs": {"environment": f"frobs_core:{REACH}"},
    "registered parts": {
        "environment_kwargs": {
            "robot": "irb120",
            "controller": "joint_position",
            "simulator": "mujoco",
            "task": "reach",
        }
    },
    "a part of a distribution": {"environment_kwargs": {"robot": "frobs-robots-abb:irb120"}},
    "plain data": {"environment_kwargs": {"tolerance": 0.02, "reward_type": "dense", "home": {"joint_1": 0.5}}},
    "images": {
        "environment_kwargs": {
            "observations": {"*": None, "eye": {"camera": "overview", "size": [84, 84], "markers": True}}
        }
    },
    "text that is a number": {"environment_kwargs": {"xacro_args": {"length": "0.5"}}},
    "wrappers": {
        "wrappers": [
            {"name": "gymnasium.wrappers:RescaleAction", "min_action": -0.5, "max_action": 0.5},
            {"name": "frobs_rl_compat.wrappers:TimeLimitWrapper", "max_steps": 100},
        ]
    },
}


@pytest.fixture
def bundle(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes a bundle whose run had another configuration."""
    original = read_pretrained(REACH)

    def bundle(**changes: Any) -> Path:
        manifest = {key: value for key, value in original.manifest.items() if key not in ("format", "files")}
        text = json.dumps(changes).replace("PATH", str(tmp_path))
        config = manifest["training"]["config"] | json.loads(text)
        manifest["training"] = manifest["training"] | {"config": config}
        path = tmp_path / "policy.frobs"
        path.write_bytes(pack_bundle(manifest, original.graph, original.license))
        return path

    return bundle


@pytest.mark.parametrize("changes", REFUSED.values(), ids=REFUSED.keys())
def test_a_bundle_cannot_name_what_is_not_registered(bundle, monkeypatch, changes):
    path = bundle(**changes)
    for function in ("make", "make_vec"):
        monkeypatch.setattr(gym, function, lambda *_, **__: pytest.fail("an environment was built"))
    monkeypatch.setattr("frobs_core.plugins.registry.import_module", lambda name: pytest.fail(f"imported {name}"))
    with pytest.raises(UntrustedFileError, match="--trust"):
        evaluate(open_run_or_bundle(path), 1)


@pytest.mark.parametrize("changes", ALLOWED.values(), ids=ALLOWED.keys())
def test_a_bundle_may_name_what_is_registered(bundle, changes):
    open_run_or_bundle(bundle(**changes))


def test_what_needs_trust_opens_with_it(bundle):
    path = bundle(environment="frobs_made_up_module:CartPole-v1")
    run = open_run_or_bundle(path, trust=True)
    with pytest.raises(ConfigurationError, match="'frobs_made_up_module' cannot be imported"):
        evaluate(run, 1)


@pytest.mark.parametrize("command", ["evaluate", "play"])
def test_the_commands_refuse_it_and_create_nothing(bundle, command):
    path = bundle(wrappers=[{"name": "gymnasium.wrappers:RecordVideo", "video_folder": "made"}])
    found = CliRunner().invoke(program(), [command, str(path), "--episodes", "1"])
    assert found.exit_code != 0
    assert isinstance(found.exception, UntrustedFileError) or "--trust" in found.output


def test_the_listed_wrappers_exist():
    from importlib import import_module

    for name in WRAPPERS:
        module, _, attribute = name.partition(":")
        assert hasattr(import_module(module), attribute), name


@pytest.mark.parametrize("steps", [10**400, -1, 1.5, "x", [], {"a": 1}, True])
def test_steps_of_another_type_are_refused(steps, tmp_path):
    original = read_pretrained(REACH)
    training = {**original.manifest["training"], "steps": steps}
    with pytest.raises(BundleError, match=r"training\.steps"):
        BundleRun(Bundle(tmp_path / "p.frobs", {**original.manifest, "training": training}, original.graph, ""))


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "[" * 900 + "]" * 900, '{"a":' * 60 + "1" + "}" * 60, '{"a": ' + "1" * 10**6 + "}"]
)
def test_a_description_that_is_nested_deeply_is_refused(tmp_path, text):
    path = tmp_path / "p.frobs"
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("policy.onnx", "bundle.json", "LICENSE"):
            archive.writestr(name, text)
    with pytest.raises(BundleError, match=r"nest|digits|JSON object"):
        read_bundle(path)


def test_a_bundle_that_is_a_fifo_is_refused(tmp_path):
    os.mkfifo(tmp_path / "p.frobs")
    with pytest.raises(BundleError, match="regular file"):
        open_run_or_bundle(tmp_path / "p.frobs")


def test_a_bundle_that_is_another_archive_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "p.frobs", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("policy.onnx", b"\0" * 10**7)
    with pytest.raises((FrobsError, DeployError)):
        open_run_or_bundle(tmp_path / "p.frobs")
