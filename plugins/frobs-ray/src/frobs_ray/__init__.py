"""Ray support for FRobs: seeds, trials and evaluations on several machines, and RLlib's algorithms."""
