"""FRobs_RL's reachers."""
