"""The page of what stands of FRobs_RL's functions and arguments, from frobs_rl.yaml."""

import importlib
import inspect
from pathlib import Path

import yaml

from generate.rst import code, escape, heading, label, literal, table

TABLES = yaml.safe_load(Path(__file__).with_name("frobs_rl.yaml").read_text("utf-8"))


def page() -> str:
    """Return the page."""
    text = label("ros") + heading("FRobs_RL's functions on ROS")
    text += (
        "``frobs-rl-compat`` provides these functions of FRobs_RL. Their names, arguments and defaults are those of FRobs_RL's "
        "documentation, which a test verifies. Each function is tested with a real ROS master and, if it affects the "
        "simulation, with the bridge over MuJoCo and over a real Gazebo 11. Processes are ended by their handles, failures "
        "are logged with the reason, and functions retry as often as documented, without unnecessary waiting.\n\n"
    )
    for module, functions in TABLES["functions"].items():
        text += heading(module, "-")
        rows = [(code(name), escape(_summary(module, name)), escape(how) or "none") for name, how in functions.items()]
        text += table(["function", "what it does", "difference from FRobs_RL"], rows, widths="30 40 30")
        text += literal("\n".join(f"{name}({_taken(module, name)})" for name in functions), "python")
    text += heading("Arguments of launch_Gazebo", "-")
    rows = [(code(name), escape(gazebo), escape(bridge)) for name, (gazebo, bridge) in TABLES["launch"].items()]
    text += table(["argument", "on Gazebo", "on the bridge"], rows, widths="25 35 40")
    text += heading("Arguments of RobotBasicEnv", "-")
    rows = [(code(name), escape(how)) for name, how in TABLES["parameters"].items()]
    return text + table(["argument", "treatment"], rows)


def _function(module, name):
    return getattr(importlib.import_module(f"frobs_rl_compat.ros.{module}"), name)


def _summary(module, name) -> str:
    return (inspect.getdoc(_function(module, name)) or "").partition("\n\n")[0].replace("\n", " ").replace("``", "'")


def _taken(module, name) -> str:
    parameters = inspect.signature(_function(module, name)).parameters.values()
    return ", ".join(p.name if p.default is p.empty else f"{p.name}={p.default!r}" for p in parameters)
