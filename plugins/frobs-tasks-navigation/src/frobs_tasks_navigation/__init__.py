"""Navigation tasks for FRobs."""
