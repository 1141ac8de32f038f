"""Replacement for ``moveit_commander`` and the ``move_group`` node, based on FRobs's motion planner."""
