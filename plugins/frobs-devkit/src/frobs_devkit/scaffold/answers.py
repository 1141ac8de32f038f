"""The scaffold's questions, and the validation of the answers.

This module imports only the standard library, because cookiecutter's hooks load it even if frobs-core is not installed.
"""

import keyword
import re
from collections.abc import Mapping

CHOICES: Mapping[str, tuple[str, ...]] = {
    "what": ("pair", "both", "robot", "task", "simulator", "controller", "algorithm"),
    "example": ("arm", "wheeled", "file"),
    "paced": ("no", "yes"),
    "failing_checks": ("reject", "expect"),
    "license": ("MIT", "BSD-3-Clause", "none"),
    "ci": ("github", "none"),
}
"""Valid answers to each multiple-choice question. The first answer is the default."""

_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_NAMESPACE = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_LONGEST = 40
_FILE_QUESTIONS = ("robot_file", "tcp", "xacro_args", "package_paths", "failing_checks")

QUESTIONS = ("what", "example", "paced", "name", *_FILE_QUESTIONS, "robot", "namespace", "author", "license", "ci")
"""All questions, in the order in which they are asked."""


def asked(answers: Mapping[str, str]) -> tuple[str, ...]:
    """Return the questions to ask, given the answers so far."""
    what, example = answers.get("what", ""), answers.get("example", "")
    left_out: set[str] = set()
    if what in ("simulator", "controller", "algorithm"):
        left_out |= {"example", "namespace", "robot", *_FILE_QUESTIONS}
    if what == "robot":
        left_out |= {"namespace"}
    if what != "simulator":
        left_out |= {"paced"}
    if what != "task":
        left_out |= {"robot"}
    if what == "task" or example != "file":
        left_out |= set(_FILE_QUESTIONS)
    return tuple(question for question in QUESTIONS if question not in left_out)


def find_problem(answers: Mapping[str, str]) -> str:
    """Return one line that describes a problem with the answers and its solution, or ``""`` if the answers are valid.

    Args:
        answers: Answers by question. Missing answers are not checked.
    """
    for question, choices in CHOICES.items():
        answer = answers.get(question, choices[0])
        if answer not in choices:
            return f"{question} is '{answer}', but it must be one of {', '.join(choices)}."
    questions = asked(answers)
    if answers.get("what") == "task" and answers.get("example") == "file":
        return "a task alone cannot use a robot from a file; choose 'pair', 'both' or 'robot' instead."
    for question, problem_of in _PROBLEMS.items():
        problem = problem_of(answers[question]) if question in questions and question in answers else ""
        if problem:
            return problem
    if "robot_file" in questions and "robot_file" in answers and not answers["robot_file"].strip():
        return "robot_file is empty; enter the path of your robot's model file."
    if "robot" in questions and "robot" in answers and not answers["robot"].strip():
        return "a task on its own requires an installed robot; enter a robot name from 'frobs list robots'."
    return ""


def _problem_of_name(name: str) -> str:
    if not _NAME.fullmatch(name):
        return f"the name '{name}' must consist of lowercase letters, digits and single underscores, such as 'my_arm'."
    if keyword.iskeyword(name) or keyword.issoftkeyword(name):
        return f"the name '{name}' is a Python keyword; choose another name, such as 'my_{name}'."
    if len(name) > _LONGEST:
        return f"the name '{name}' has {len(name)} characters; at most {_LONGEST} are allowed."
    return ""


def _problem_of_namespace(namespace: str) -> str:
    if not _NAMESPACE.fullmatch(namespace):
        return f"the namespace '{namespace}' must begin with a letter and contain only letters, digits, - and _, such as 'lab'."
    if namespace == "frobs":
        return "the namespace 'frobs' is reserved for FRobs; use the name of your lab, team or company."
    return ""


def _problem_of_author(author: str) -> str:
    if not author.strip() or any(character in '"\\' or not character.isprintable() for character in author):
        return f"the author {author!r} must be a single line without quotes or backslashes."
    return ""


_PROBLEMS = {"name": _problem_of_name, "namespace": _problem_of_namespace, "author": _problem_of_author}
