"""The PyBullet simulator for FRobs."""
