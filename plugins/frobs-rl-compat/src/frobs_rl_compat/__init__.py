"""What lies behind the import names of FRobs_RL.

    manner.py         the two manners in which environments answer, and the way from each to the other
    named_imports.py  which of them a class has: by the name that its file imports
    wrapping.py       wrappers that answer as what they wrap
    models.py         algorithms that train on both
    ros.py            ROS, where it is installed
    old_gym/          what the last-resort ``gym`` is made of
    last_resort/      that ``gym``, found where no real one is installed
    startup.py        what every start of Python does: makes it and the ROS package ``frobs_rl`` findable
    migrate/          from a package of FRobs_RL to a plugin: ``frobs migrate``

Nothing is imported here: each start of Python passes by.
"""
