"""Support for running and migrating packages written for FRobs_RL.

- ``legacy.py``: environment variables that ``frobs legacy`` sets for old packages
- ``overlay/``: the replacements for ``gym`` and ``moveit_commander`` that old packages import
- ``old_gym/``: implementation of the replacement for ``gym``
- ``moveit/``: implementation of the replacement for ``moveit_commander``
- ``manner.py``: conversion between the old gym API and Gymnasium's API
- ``wrapping.py``: mixin that lets wrappers keep the API of the wrapped environment
- ``models.py``: mixin for algorithms that also accept environments with the old gym API
- ``migrate/``: conversion of FRobs_RL packages to plugins, used by ``frobs migrate``

Importing this package does not import its modules.
"""
