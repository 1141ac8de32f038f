"""What :mod:`frobs_ros.ros_gazebo` offers, by subject: launching, physics, the world's time, models."""
