"""The robot 'my_arm' for FRobs."""
