"""Converts a package of FRobs_RL to a plugin, and its YAML files to run configurations.

python_files.py   the package's classes and calls, by ``ast``
expressions.py    values of expressions, without running them
constructor.py    values that a constructor sets, in order
package.py        all information of a package
yaml_files.py     its YAML files: learning, controllers, numbers
robot.py          its URDF or xacro file
recognition.py    whether its task is one of FRobs_RL's example tasks
examples.py       the parameters of the equivalent task of FRobs
values.py         values that constructors set, or why the task cannot be translated
world.py          walls, boxes, starts and goals as a floor plan
plugin.py         the resulting plugin
example_files.py  its task, if FRobs has an equivalent one
task.py           its task, if it is a skeleton
comments.py       TODO comments
report.py         which parts were migrated, and which were not
"""

from frobs_rl_compat.migrate.package import OldPackage, read_package
from frobs_rl_compat.migrate.plugin import migrate_package
from frobs_rl_compat.migrate.report import Migration
from frobs_rl_compat.migrate.yaml_files import migrate_yaml

__all__ = ["Migration", "OldPackage", "migrate_package", "migrate_yaml", "read_package"]
