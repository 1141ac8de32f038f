"""Any FRobs simulation as Gazebo: the services and topics of gazebo_ros and of its controller managers."""
