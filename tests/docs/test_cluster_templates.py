"""The files for clusters are valid: the script for Slurm and the manifest for Kubernetes."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from pages import DOCS, ROOT, blocks

from frobs_cli.program import walk

FOLDER = ROOT / "templates" / "cluster"
SCRIPT = FOLDER / "slurm.sh"
SCHEMA = json.loads((Path(__file__).parent / "data" / "kuberay_rayjob.json").read_text("utf-8"))
CLAIM, JOB = yaml.safe_load_all((FOLDER / "kuberay.yaml").read_text("utf-8"))


def test_bash_accepts_the_slurm_script() -> None:
    subprocess.run(["bash", "-n", str(SCRIPT)], check=True)


def test_the_slurm_script_starts_with_the_options_of_sbatch() -> None:
    first, *lines = SCRIPT.read_text("utf-8").splitlines()
    assert first == "#!/bin/bash"
    assert lines[0].startswith("#SBATCH ")  # sbatch reads no option after the first command


def test_the_manifest_follows_the_schema_of_kuberay() -> None:
    jsonschema.validate(JOB, SCHEMA)


@pytest.mark.parametrize("typing_error", ["entryPoint", "rayClusterSpec.headGroupSpecs", "shutdownAfterJobFinishes"])
def test_the_schema_finds_errors(typing_error: str) -> None:
    wrong = deepcopy(JOB)
    *path, last = typing_error.split(".")
    inner = wrong["spec"]
    for key in path:
        inner = inner[key]
    inner[last] = "wrong"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, SCHEMA)


def test_all_pods_share_the_volume_and_the_image() -> None:
    groups = [JOB["spec"]["rayClusterSpec"]["headGroupSpec"], *JOB["spec"]["rayClusterSpec"]["workerGroupSpecs"]]
    pods = [group["template"]["spec"] for group in groups]
    assert {pod["volumes"][0]["persistentVolumeClaim"]["claimName"] for pod in pods} == {CLAIM["metadata"]["name"]}
    assert len({pod["containers"][0]["image"] for pod in pods}) == 1


def frobs_commands() -> list[list[str]]:
    """Return the arguments of each ``frobs`` command in the files and on the page about clusters."""
    script = SCRIPT.read_text("utf-8").replace("\\\n", " ")
    page = "".join(block.text.replace("\\\n", " ") for block in blocks(DOCS / "how-to" / "cluster.md"))
    texts = [JOB["spec"]["entrypoint"], *re.findall(r"^\s*(?:.* -- +)?(frobs .*)$", f"{script}\n{page}", re.MULTILINE)]
    return [shlex.split(text, comments=True) for text in texts]


def test_the_commands_have_existing_options() -> None:
    known = {name: {option for p in command.params for option in p.opts} for name, command in walk()}
    commands = frobs_commands()
    assert len(commands) >= 4
    for command in commands:
        options = {argument.partition("=")[0] for argument in command if argument.startswith("--")}
        assert options <= known[f"frobs {command[1]}"], command


@pytest.mark.needs("ray")
@pytest.mark.slow
def test_the_options_of_ray_exist() -> None:
    page = "".join(block.text for block in blocks(DOCS / "how-to" / "cluster.md"))
    used = {"num-cpus", "include-dashboard", "disable-usage-stats"}
    used |= {option for line in page.splitlines() if "ray start" in line for option in re.findall(r"--([\w-]+)", line)}
    ray = Path(sys.executable).with_name("ray")
    shown: Any = subprocess.run([str(ray), "start", "--help"], check=True, text=True, capture_output=True).stdout
    assert used <= set(re.findall(r"--([\w-]+)", shown))
