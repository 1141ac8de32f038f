"""New plugins from templates: what ``frobs new`` does, and the hooks of the cookiecutter.

    answers.py      the questions, and what is wrong with an answer
    clashes.py      what is installed already under a name
    robot_file.py   what a robot's description takes from its model file
    rendering.py    renders the templates
    finish.py       what is done afterwards

The templates are ``cookiecutter/`` and ``templates/`` of the repository; they travel in the wheel.
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
