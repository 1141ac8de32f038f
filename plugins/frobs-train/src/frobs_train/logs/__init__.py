"""Records of a training run."""
