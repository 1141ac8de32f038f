"""The implementation behind the import names of FRobs_RL.

legacy.py    the environment variables with which old packages run: ``frobs legacy``
overlay/     the package ``gym`` that they import
old_gym/     its implementation
manner.py    old gym's API and Gymnasium's, and wrappers from each to the other
wrapping.py  wrappers that keep the API of what they wrap
models.py    algorithms that train on both
migrate/     makes a plugin of a package of FRobs_RL: ``frobs migrate``

Importing this package imports nothing else.
"""
