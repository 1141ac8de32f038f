"""FRobs_RL's reaching tasks."""
