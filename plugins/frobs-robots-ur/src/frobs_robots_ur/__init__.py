"""Universal Robots arms for FRobs."""
