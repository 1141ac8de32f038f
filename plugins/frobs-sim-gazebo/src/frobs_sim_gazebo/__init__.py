"""Gazebo 11 as a simulator for FRobs."""
