"""Integration of RLlib's algorithms into FRobs."""
