"""The algorithms of RLlib as algorithms of FRobs."""
