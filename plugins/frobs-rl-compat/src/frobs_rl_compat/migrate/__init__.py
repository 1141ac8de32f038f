"""Writes the skeleton of a plugin for a FRobs_RL package, and converts its YAML files to run configurations.

- ``python_files.py``: finds the package's classes and function calls with ``ast``
- ``package.py``: collects all information about a package
- ``yaml_files.py``: reads and converts YAML files with training settings, controllers and task parameters
- ``robot.py``: reads the URDF or xacro file
- ``plugin.py``: creates the plugin
- ``task.py``: edits the plugin's task
- ``comments.py``: inserts TODO comments
- ``advice.py``: gives advice on porting the parts that are not migrated
- ``counterparts.yaml``: what corresponds to the parts of a FRobs_RL package in FRobs
- ``migration.py``: lists which parts were migrated and which were not, and defines the error class
"""

from frobs_rl_compat.migrate.migration import Migration
from frobs_rl_compat.migrate.package import OldPackage, read_package
from frobs_rl_compat.migrate.plugin import migrate_package
from frobs_rl_compat.migrate.yaml_files import migrate_yaml

__all__ = ["Migration", "OldPackage", "migrate_package", "migrate_yaml", "read_package"]
