"""Try what is installed in an environment: ``.ci/wheels.py`` runs this file in each.

$ python -P smoke.py frobs_core frobs_cli           # imports packages and loads the plugins
$ python -P smoke.py --everything frobs_core        # also imports what each plugin offers, and steps an environment
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec

NOT_HERE = ["Gazebo 11 is not here"]
"""Beginnings of messages about engines that pip does not install."""
if sys.version_info >= (3, 12):
    NOT_HERE.append("PyBullet has no wheel for Python")


def load_plugins() -> None:
    """Load the plugins that are installed."""
    from frobs_core import plugins

    broken = [f"{report.name}: {report.cause}" for report in plugins.reports() if report.state != "loaded"]
    assert not broken, broken


def use_everything() -> None:
    """Import what each plugin offers, and step an environment."""
    import gymnasium as gym

    from frobs_core import plugins
    from frobs_core.plugins.records import KINDS
    from frobs_core.util.errors import PluginError

    for kind in KINDS:
        for record in plugins.active().records(kind).values():
            try:
                record.load()
            except PluginError as error:
                if not any(text in str(error) for text in NOT_HERE):
                    raise
    env = gym.make("frobs_core:frobs/Irb120Reach-v0")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.close()


def main() -> None:
    """Try the packages that are named on the command line."""
    for name in sys.argv[1:]:
        if not name.startswith("--"):
            import_module(name)
    if find_spec("frobs_core"):
        load_plugins()
    if "--everything" in sys.argv:
        use_everything()


if __name__ == "__main__":
    main()
