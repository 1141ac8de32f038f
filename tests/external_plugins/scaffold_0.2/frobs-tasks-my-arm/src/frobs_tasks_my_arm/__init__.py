"""The task 'my_arm_reach' for FRobs."""
