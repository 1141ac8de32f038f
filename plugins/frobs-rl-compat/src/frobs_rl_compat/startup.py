"""What every start of Python does where this distribution is installed; ``frobs_rl_compat.pth`` imports it.

It makes three things findable, and imports none: the module ``gym`` where there is no real one, ROS's modules where ROS is
installed beside this Python, and the ROS package ``frobs_rl``. It costs less than a millisecond.
"""

import os
import sys
from _thread import get_ident
from importlib.machinery import ModuleSpec
from types import FrameType

_HERE = os.path.dirname(os.path.abspath(__file__))
ROS_PACKAGE = os.path.join(os.path.dirname(_HERE), "frobs_rl")
"""The folder of the ROS package, which is that of the Python package."""

_VARIABLE = "ROS_PACKAGE_PATH"


_OF_ROS = frozenset(
    [
        "actionlib",
        "actionlib_msgs",
        "control_msgs",
        "controller_manager_msgs",
        "gazebo_msgs",
        "geometry_msgs",
        "nav_msgs",
        "rosgraph",
        "roslaunch",
        "rosnode",
        "rosparam",
        "rospkg",
        "rosservice",
        "rospy",
        "rostopic",
        "sensor_msgs",
        "std_msgs",
        "std_srvs",
        "tf",
        "tf2_ros",
        "trajectory_msgs",
    ]
)
"""What packages of FRobs_RL import of ROS at the top of their files."""

_MOVEIT = frozenset(["moveit_commander", "moveit_msgs"])

_asking: set[int] = set()
"""Threads that ask the other finders at the moment."""


class LastResort:
    """Finds what nothing else finds: our ``gym``, and ROS's modules where ROS is installed but not linked.

    An ``import`` of what is missing of ROS, or of MoveIt, says what to do about it.
    """

    @classmethod
    def find_spec(cls, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return where a module is; for all other names None.

        Raises:
            ModuleNotFoundError: A module of ROS or MoveIt is imported, and missing.
        """
        thread = get_ident()
        if (name != "gym" and name not in _OF_ROS and name not in _MOVEIT) or thread in _asking:
            return None
        _asking.add(thread)
        try:
            found = _ask_others(name)
            if found is None:
                found = _our_gym() if name == "gym" else _of_ros(name)
            if found is None and _is_imported(sys._getframe(1)):
                raise _missing(name)
        finally:
            _asking.discard(thread)
        return found


def _ask_others(name: str) -> ModuleSpec | None:
    """Return what the finders know that came after ours, as editable installs have them."""
    for finder in sys.meta_path[sys.meta_path.index(LastResort) + 1 :]:  # type: ignore[arg-type]
        found = finder.find_spec(name, None)
        if found is not None:
            return found
    return None


def _is_imported(caller: FrameType) -> bool:
    """Return whether a finder's caller carries out an ``import``: who only asks where a module is, is told None."""
    behind = caller.f_back
    return (
        caller.f_code.co_name == "_find_spec" and behind is not None and behind.f_code.co_name.startswith("_find_and")
    )


def _missing(name: str) -> ModuleNotFoundError:
    from frobs_rl_compat.ros import why_missing

    return ModuleNotFoundError(f"No module named '{name}': {why_missing(name)}", name=name)


def _our_gym() -> ModuleSpec | None:
    from importlib.util import spec_from_file_location

    folder = os.path.join(_HERE, "last_resort", "gym")
    return spec_from_file_location("gym", os.path.join(folder, "__init__.py"), submodule_search_locations=[folder])


def _of_ros(name: str) -> ModuleSpec | None:
    """Return where a module of ROS is, and make the others findable."""
    from importlib.util import find_spec

    from frobs_rl_compat.ros import make_findable

    return find_spec(name) if make_findable() else None


def install() -> None:
    """Do it; twice is harmless."""
    if LastResort not in sys.meta_path:
        sys.meta_path.append(LastResort)
    folders = [folder for folder in os.environ.get(_VARIABLE, "").split(os.pathsep) if folder]
    if ROS_PACKAGE not in folders:
        os.environ[_VARIABLE] = os.pathsep.join([*folders, ROS_PACKAGE])


install()
