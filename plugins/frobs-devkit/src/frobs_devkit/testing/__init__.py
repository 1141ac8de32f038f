"""The conformance kit, a collection of checks for plugin authors.

Each ``check_…`` function returns a list of named checks. To run each check as a pytest test, write::

    from frobs_devkit.testing import check_env, pytest_checks

    test_conformance = pytest_checks(check_env("my_package:lab/MyReach-v0"))

To run the checks without pytest, call :func:`run_checks`. The command ``frobs check`` calls :func:`find_subject` and
:func:`run_checks`.
"""

from frobs_devkit.testing.algorithm import check_algorithm
from frobs_devkit.testing.checks import Check, CheckFailure, Inconclusive, NotApplicable
from frobs_devkit.testing.controller import check_controller
from frobs_devkit.testing.environment import check_env
from frobs_devkit.testing.extension import check_extension
from frobs_devkit.testing.find import Subject, find_subject
from frobs_devkit.testing.plugin import check_plugin
from frobs_devkit.testing.policy import check_policy
from frobs_devkit.testing.results import Report, Result, pytest_checks, run_checks
from frobs_devkit.testing.robot import check_robot
from frobs_devkit.testing.simulator import check_simulator
from frobs_devkit.testing.task import check_task

__all__ = [
    "Check",
    "CheckFailure",
    "Inconclusive",
    "NotApplicable",
    "Report",
    "Result",
    "Subject",
    "check_algorithm",
    "check_controller",
    "check_env",
    "check_extension",
    "check_plugin",
    "check_policy",
    "check_robot",
    "check_simulator",
    "check_task",
    "find_subject",
    "pytest_checks",
    "run_checks",
]
