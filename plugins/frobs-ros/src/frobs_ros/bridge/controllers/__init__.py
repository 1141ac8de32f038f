"""Controllers of ros_control and the manager that loads, starts and stops controllers."""
