"""Creates plugins from templates, for ``frobs new`` and for the hooks of the cookiecutter template.

    answers.py      defines the questions and validates the answers
    clashes.py      detects name clashes with installed plugins
    robot_file.py   derives a robot's description from its model file
    rendering.py    renders the templates
    finish.py       cleans up after rendering

The repository's folders ``cookiecutter/`` and ``templates/`` contain the templates, which are included in the wheel.
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
