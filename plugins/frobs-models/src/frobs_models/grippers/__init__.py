"""Finds grippers in model files from geometry alone: no names of links or joints are used."""
