"""What the last-resort ``gym`` is made of: the names of gym 0.21 over Gymnasium, in the old manner."""
