#!/bin/sh
# Install ROS 2 for the tests of frobs-ros2, in a folder that only the processes of these tests see: about 150 MB, half a
# minute. The wheels contain std_msgs and other packages that ROS 1 has too, so they must not be in the virtual environment.
set -eu
cd "$(dirname "$0")/.."
prefix=build/ros2
[ -e "$prefix/.installed" ] && exit 0
.venv/bin/python -m pip -qq --no-input install --no-compile --no-warn-script-location --prefix "$prefix" \
  --constraint constraints.txt ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-sensor-msgs \
  ros-jazzy-trajectory-msgs ros-jazzy-std-srvs ros-jazzy-rosgraph-msgs ros-jazzy-nav-msgs cyclonedds==11.0.1
touch "$prefix/.installed"
