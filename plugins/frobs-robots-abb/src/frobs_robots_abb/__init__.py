"""ABB arms for FRobs."""
