"""The stand-in for ``moveit_commander`` and the node ``move_group``, based on the planner of FRobs."""
