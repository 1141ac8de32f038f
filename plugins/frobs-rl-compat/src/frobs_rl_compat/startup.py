"""What every start of Python does where this distribution is installed; ``frobs_rl_compat.pth`` imports it.

It makes two things findable, and imports neither: the module ``gym`` where there is no real one, and the ROS package
``frobs_rl``. It costs less than a millisecond.
"""

import os
import sys
from importlib.machinery import ModuleSpec

_HERE = os.path.dirname(os.path.abspath(__file__))
ROS_PACKAGE = os.path.join(os.path.dirname(_HERE), "frobs_rl")
"""The folder of the ROS package, which is that of the Python package."""

_VARIABLE = "ROS_PACKAGE_PATH"


class LastResort:
    """Finds our ``gym`` where nothing else finds one: asked last, and it asks the others once more."""

    @classmethod
    def find_spec(cls, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return where the module is; for every other name None."""
        if name != "gym":
            return None
        for finder in sys.meta_path[sys.meta_path.index(cls) + 1 :]:  # type: ignore[arg-type]
            found = finder.find_spec(name, None)  # a finder that came after this one, as editable installs have
            if found is not None:
                return found
        from importlib.util import spec_from_file_location

        folder = os.path.join(_HERE, "last_resort", "gym")
        return spec_from_file_location(
            name, os.path.join(folder, "__init__.py"), submodule_search_locations=[folder]
        )  # fmt: skip


def install() -> None:
    """Do it; twice is harmless."""
    if LastResort not in sys.meta_path:
        sys.meta_path.append(LastResort)
    folders = [folder for folder in os.environ.get(_VARIABLE, "").split(os.pathsep) if folder]
    if ROS_PACKAGE not in folders:
        os.environ[_VARIABLE] = os.pathsep.join([*folders, ROS_PACKAGE])


install()
