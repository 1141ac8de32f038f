"""ros_control's controllers, and the manager that loads, starts and stops them."""
