"""Exports the Gazebo simulation class. Importing this module fails if Gazebo is not installed."""

from frobs_sim_gazebo.installation import find_gazebo
from frobs_sim_gazebo.simulation import GazeboSimulation

find_gazebo()

__all__ = ["GazeboSimulation"]
