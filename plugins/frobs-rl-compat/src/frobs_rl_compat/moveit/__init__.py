"""The stand-in for ``moveit_commander`` and for the node ``move_group``, over the planner of FRobs."""
