"""Running many jobs: seeds, trials and evaluations, on this machine or on others."""
