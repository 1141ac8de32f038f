"""The simulator ``ros``: a robot that is controlled through ROS topics, as a paced simulation."""
