"""Converts a FRobs_RL package to a plugin, and its YAML files to run configurations.

- ``python_files.py``: finds the package's classes and function calls with ``ast``
- ``expressions.py``: evaluates expressions from their syntax, without executing code
- ``constructor.py``: determines the values that constructors set
- ``package.py``: collects all information about a package
- ``yaml_files.py``: reads YAML files with training settings, controllers and task parameters
- ``robot.py``: reads the URDF or xacro file
- ``recognition.py``: recognizes FRobs_RL's example tasks
- ``examples.py``: determines the parameters of FRobs's equivalent task
- ``values.py``: looks up the values that a recognized task uses
- ``world.py``: converts walls, boxes, starts and goals to a floor plan
- ``plugin.py``: creates the plugin
- ``example_files.py``: configures the plugin's task if FRobs has an equivalent task
- ``task.py``: edits the plugin's task if FRobs has no equivalent task
- ``original.py``: writes the old environment's spaces and numerical constants into the plugin
- ``comments.py``: inserts TODO comments
- ``advice.py``: gives advice on porting the parts that are not migrated
- ``migration.py``: lists which parts were migrated and which were not
- ``errors.py``: the error class
"""

from frobs_rl_compat.migrate.migration import Migration
from frobs_rl_compat.migrate.package import OldPackage, read_package
from frobs_rl_compat.migrate.plugin import migrate_package
from frobs_rl_compat.migrate.yaml_files import migrate_yaml

__all__ = ["Migration", "OldPackage", "migrate_package", "migrate_yaml", "read_package"]
