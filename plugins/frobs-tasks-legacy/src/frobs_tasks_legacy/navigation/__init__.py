"""FRobs_RL's navigation tasks."""
