"""A planar arm of two joints."""
