"""Rejects invalid answers before any file is written."""

import importlib.util
import json
import sys
from pathlib import Path

ANSWERS = json.loads(r"""{{ cookiecutter | jsonify }}""")
CHECKS = Path(r"{{ cookiecutter._repo_dir }}").resolve().parent / "plugins/frobs-devkit/src/frobs_devkit/scaffold/answers.py"


def refuse(problem):
    """Exit with a single-line error message."""
    sys.exit(f"error: {problem}")


def check_alone(answers):
    """Check the answers without requiring that frobs-devkit is installed."""
    spec = importlib.util.spec_from_file_location("answers", CHECKS)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    problem = module.find_problem(answers)
    if problem:
        refuse(problem)


def check_installed(answers):
    """Check the answers against the installed packages and the robot's model file."""
    try:
        from frobs_core.util.errors import FrobsError
        from frobs_devkit.scaffold.clashes import check_clashes
        from frobs_devkit.scaffold.robot_file import facts_for
    except ImportError:
        if answers["example"] == "file" and "robot" in answers["__kinds"]:
            refuse("reading the robot's model file requires frobs-devkit; install it in cookiecutter's environment: pip install frobs-devkit")
        return
    try:
        check_clashes(answers)
        if answers["example"] == "file" and "robot" in answers["__kinds"]:
            facts_for(answers)
    except FrobsError as error:
        refuse(error)


check_alone(ANSWERS)
check_installed(ANSWERS)
