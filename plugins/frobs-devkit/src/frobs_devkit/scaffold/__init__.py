"""Creation of plugins from templates, for ``frobs new`` and for the hooks of the cookiecutter.

    answers.py      the questions, and validation of the answers
    clashes.py      name clashes with installed plugins
    robot_file.py   derives a robot's description from its model file
    rendering.py    renders the templates
    finish.py       cleans up after rendering

The templates are in ``cookiecutter/`` and ``templates/`` of the repository and are included in the wheel.
"""

from frobs_devkit.scaffold.answers import CHOICES, QUESTIONS, asked, find_problem
from frobs_devkit.scaffold.rendering import fill_in, prompts, render, resolve, template_folder
from frobs_devkit.scaffold.robot_file import copy_model

__all__ = [
    "CHOICES",
    "QUESTIONS",
    "asked",
    "copy_model",
    "fill_in",
    "find_problem",
    "prompts",
    "render",
    "resolve",
    "template_folder",
]
