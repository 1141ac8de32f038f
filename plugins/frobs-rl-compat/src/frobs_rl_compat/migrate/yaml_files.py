"""Reads a package's YAML files, which contain training settings, controllers and task parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from frobs_cli.errors import TargetExistsError
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.yaml import dump_yaml, load_yaml
from frobs_rl_compat.migrate.migration import COUNTERPARTS, Migration, MigrationError
from frobs_rl_compat.training import ROOT, algorithms_in, translate


@dataclass
class YamlFiles:
    """A package's YAML files, grouped by purpose."""

    learning: dict[Path, Mapping[str, Any]] = field(default_factory=dict)  # settings of FRobs_RL's algorithms
    controllers: dict[Path, Mapping[str, Any]] = field(default_factory=dict)  # settings of ROS controllers
    numbers: dict[Path, Mapping[str, Any]] = field(default_factory=dict)  # all others, such as task parameters
    unread: dict[Path, str] = field(default_factory=dict)  # error message for each file that cannot be read


def read_yaml_files(folder: Path) -> YamlFiles:
    """Read all YAML files of a package."""
    files = YamlFiles()
    for path in sorted([*folder.rglob("*.yaml"), *folder.rglob("*.yml")]):
        if any(part.startswith(".") or part in ("build", "devel") for part in path.relative_to(folder).parts):
            continue
        try:
            mapping = load_yaml(path)
        except ConfigurationError as error:
            files.unread[path] = str(error)
            continue
        kind = files.learning if ROOT in mapping else files.controllers if _controls(mapping) else files.numbers
        kind[path] = mapping
    return files


def run_configuration(path: Path, mapping: Mapping[str, Any], environment: str | None) -> tuple[str, str]:
    """Convert a FRobs_RL training file to a run configuration, and return it and a note about ignored settings."""
    algorithms = algorithms_in(mapping)
    if not algorithms:
        raise MigrationError(
            path, f"the key '{ROOT}' contains no algorithm's parameters; add a key such as ppo_params or td3_params."
        )
    begins_with_model = mapping[ROOT].get("load_model")
    config, note = translate({**mapping, ROOT: {**mapping[ROOT], "load_model": False}}, algorithms[0], path)
    if begins_with_model:
        note = (
            f"load_model is not supported: the run starts with a new model instead of "
            f"{mapping[ROOT].get('model_name')}. {note}".strip()
        )
    if len(algorithms) > 1:
        note = f"{note} Ignored parameters of other algorithms: {', '.join(algorithms[1:])}.".strip()
    head = f"# Converted from FRobs_RL's {path.name} by 'frobs migrate'. Observations are not normalized.\n"
    if environment is None:
        head += "# TODO: set the environment key, or pass the environment's ID: frobs train ID --config THIS_FILE.\n"
    return head + dump_yaml({**({"environment": environment} if environment else {}), **config}), note


def migrate_yaml(path: Path, out: Path) -> Migration:
    """Convert one YAML file to a run configuration.

    Args:
        path: A file with ``model_params``, or with the task parameters of one of FRobs_RL's examples.
        out: Folder of the new file.

    Raises:
        ConfigurationError: The file has an unsupported format, or the new file already exists.
    """
    mapping = load_yaml(path)
    target = out / f"{path.stem}_run.yaml"
    if target.exists():
        raise TargetExistsError(target, "move the existing file, or choose another folder with --out")
    made = Migration(path.name, target)
    if ROOT in mapping:
        text, note = run_configuration(path, mapping, None)
        made.carry(f"{ROOT}: training, noise, networks", target.name)
        if note:
            made.leave("keys that are not supported", note.replace(f"{path}: ", ""))
        made.leave("the environment", "pass the environment's ID on the command line")
        made.next.append(f"frobs train ID --config {target}")
    else:
        ids = COUNTERPARTS["task_files"]
        root = next((key for key in mapping if key in ids), None)
        if root is None:
            raise MigrationError(
                path,
                f"expected the key '{ROOT}' or one of {', '.join(ids)}, but the file's keys are "
                f"{', '.join(map(str, mapping))}. To migrate the parameters of any other task, migrate the whole "
                "package.",
            )
        text = f"# {ids[root]} accepts FRobs_RL's {path.name} unchanged.\n" + dump_yaml(
            {"environment": ids[root], "environment_kwargs": {"config_file": str(path.absolute())}}
        )
        made.carry(f"the parameters under '{root}'", f"{target.name}: environment_kwargs.config_file")
        made.next.append(f"frobs train {ids[root]} --config {target}")
    out.mkdir(parents=True, exist_ok=True)
    target.write_text(text, "utf-8")
    return made


def _controls(mapping: Mapping[str, Any]) -> bool:
    """Return whether a file describes controllers, either at its root or under a single root key."""
    values = list(mapping.values())
    if any(isinstance(value, Mapping) and "/" in str(value.get("type", "")) for value in values):
        return True
    return len(values) == 1 and isinstance(values[0], Mapping) and _controls(values[0])
