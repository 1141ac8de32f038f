"""SO-101 arm for FRobs."""
