"""The simulation, where there is a Gazebo: importing this fails where there is none, as with any engine that is missing."""

from frobs_sim_gazebo.installation import find_gazebo
from frobs_sim_gazebo.simulation import GazeboSimulation

find_gazebo()

__all__ = ["GazeboSimulation"]
