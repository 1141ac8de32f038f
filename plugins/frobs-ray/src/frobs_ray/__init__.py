"""Ray for FRobs: seeds, trials and evaluations on several machines, and the algorithms of RLlib."""
