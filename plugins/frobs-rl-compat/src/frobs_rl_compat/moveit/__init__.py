"""Stand-in for ``moveit_commander`` and the node ``move_group``, based on FRobs's motion planner."""
