"""Manipulation tasks for FRobs."""

from frobs_core.deprecation import keep_moved_modules

keep_moved_modules(
    {
        "frobs_tasks_manipulation.cube_task": ["frobs_tasks_manipulation.manipulation"],
        "frobs_tasks_manipulation.open_door": ["frobs_tasks_manipulation.open_task"],
        "frobs_tasks_manipulation.open_drawer": ["frobs_tasks_manipulation.open_task"],
    }
)
