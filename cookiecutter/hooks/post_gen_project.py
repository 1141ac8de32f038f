"""Removes empty files and folders, and copies the robot's model file into the plugin."""

import importlib.util
import json
import sys
from pathlib import Path

ANSWERS = json.loads(r"""{{ cookiecutter | jsonify }}""")
FINISH = Path(r"{{ cookiecutter._repo_dir }}").resolve().parent / "plugins/frobs-devkit/src/frobs_devkit/scaffold/finish.py"

spec = importlib.util.spec_from_file_location("finish", FINISH)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
module.finish(Path.cwd())
if problem := module.hidden_import(Path.cwd()):
    sys.exit(f"error: {problem}")
module.finish_robot(Path.cwd(), ANSWERS)
