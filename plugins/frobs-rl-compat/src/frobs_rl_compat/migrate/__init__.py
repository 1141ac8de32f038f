"""From a package of FRobs_RL to a plugin, and from its YAML files to run configurations.

python_files.py   the package's classes and calls, by ``ast``
expressions.py    values of expressions, without running them
constructor.py    what a constructor sets, in its order
package.py        all that a package says
yaml_files.py     its YAML files: learning, controllers, numbers
robot.py          its URDF or xacro file
recognition.py    whether its task is one of FRobs_RL's example tasks
examples.py       the parameters of FRobs's task that is the same
values.py         what constructors set, or why the task cannot be translated
world.py          walls, boxes, starts and goals as a floor plan
plugin.py         the plugin that is made of it
example_files.py  its task, if FRobs has the same one
task.py           its task, if it is a skeleton
comments.py       comments that say what is to do
report.py         what was carried over, and what was not
"""

from frobs_rl_compat.migrate.package import OldPackage, read_package
from frobs_rl_compat.migrate.plugin import migrate_package
from frobs_rl_compat.migrate.report import Migration
from frobs_rl_compat.migrate.yaml_files import migrate_yaml

__all__ = ["Migration", "OldPackage", "migrate_package", "migrate_yaml", "read_package"]
