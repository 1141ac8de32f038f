"""The implementation of the import names of FRobs_RL.

legacy.py    environment variables for old packages: ``frobs legacy``
overlay/     the package ``gym`` that they import
old_gym/     its implementation
manner.py    old gym's API and Gymnasium's, and wrappers that convert between them
wrapping.py  wrappers that keep the API of the wrapped environment
models.py    algorithms that train on both APIs
migrate/     conversion of a FRobs_RL package to a plugin: ``frobs migrate``

Importing this package imports no other module.
"""
