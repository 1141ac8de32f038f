"""Controllers as ros_control has them, and the manager that loads, starts and stops them."""
