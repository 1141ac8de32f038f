"""Runs any FRobs simulation with the services and topics of gazebo_ros and its controller managers."""
