"""The Kobuki mobile robot for FRobs."""
