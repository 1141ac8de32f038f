"""Bridge that provides the services and topics of gazebo_ros and its controller managers for any FRobs simulation."""
