"""The MuJoCo simulator for FRobs."""
