"""The model files to examine: the robots of ``example-robot-data`` and ``pybullet_data`` that have a moving joint."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path

_MOVES = re.compile(rb'<joint\b[^>]*type\s*=\s*"(?!fixed)')

REFUSED = {
    "example-robot-data/alex_description/urdf/alex_psyonic_hands.urdf": "mimics 'index_q1', which does not exist",
    "example-robot-data/ur_description/urdf/ur3.urdf": "there is no <link>",
    "pybullet_data/bicycle/bike.urdf": 'xyz="0.07, 0, -0.69" is not 3 numbers',
    "pybullet_data/biped/biped2d_pybullet.urdf": 'lower="-1.57." is not one number',
    "pybullet_data/humanoid/humanoid.urdf": "not well-formed",
    "pybullet_data/husky/husky.urdf": "Macros are expanded only in files whose names end in '.xacro'",
    "pybullet_data/kuka_iiwa/model_for_sdf.urdf": "'meshes/coarse/link_0.stl' is missing",
    "pybullet_data/quadruped/microtaur/microtaur.urdf": "contains 4 numbers; it requires 3",
    "pybullet_data/racecar/racecar_differential.urdf": 'scale="1 1 1 1" contains 4 numbers',
    "pybullet_data/spherical_joint_limit.urdf": "the joint type 'spherical' does not exist",
}
"""Files that are not robots that can be built, each with the reason that has to be given."""

UNDRAWN = (
    "example-robot-data/romeo_description/urdf/romeo_laas_small.urdf",
    "pybullet_data/differential/diff_ring.urdf",
)
"""Files that name visual meshes which do not exist. They are read with a warning; a simulator draws less than they say."""

PARTED: dict[str, tuple[str, ...]] = {
    "example-robot-data/b1_description/urdf/b1-z1.urdf": ("links touch",),
    "example-robot-data/baxter_description/urdf/baxter.urdf": ("links touch",),
    "example-robot-data/icub_description/robots/icub.urdf": ("links touch",),
    "example-robot-data/icub_description/robots/icub_reduced.urdf": ("links touch",),
    "example-robot-data/pr2_description/urdf/pr2.urdf": ("links touch",),
    "example-robot-data/romeo_description/urdf/romeo.urdf": ("joints mimic",),
    "example-robot-data/talos_data/robots/talos_full_v2.urdf": ("links touch", "joints mimic"),
    "example-robot-data/talos_data/robots/talos_full_v2_box.urdf": ("links touch", "joints mimic"),
    "example-robot-data/talos_data/robots/talos_reduced.urdf": ("links touch",),
    "example-robot-data/talos_data/robots/talos_reduced_box.urdf": ("links touch",),
    "example-robot-data/talos_data/robots/talos_reduced_corrected.urdf": ("links touch",),
    "example-robot-data/tiago_pro_description/robots/tiago_pro.urdf": ("joints mimic",),
    "example-robot-data/z1_description/urdf/z1.urdf": ("links touch",),
    "pybullet_data/franka_panda/panda.urdf": ("links touch",),
    "pybullet_data/quadruped/spirit40newer.urdf": ("links touch",),
}
"""Robots whose free motion is not the same on both simulators, each with what makes it so: see :mod:`free_motion`."""

FAST = (
    "example-robot-data/panda_description/urdf/panda.urdf",
    "example-robot-data/ur_description/urdf/ur10_robot.urdf",
    "pybullet_data/xarm/xarm6_robot.urdf",
    "pybullet_data/r2d2.urdf",
    "pybullet_data/laikago/laikago_toes.urdf",
)


def files() -> dict[str, Path]:
    """Return each file by the name that tables give it."""
    found: dict[str, Path] = {}
    data = _example_robot_data()
    if data is not None:
        for file in sorted((data / "robots").rglob("*.urdf")):
            found[f"example-robot-data/{file.relative_to(data / 'robots').as_posix()}"] = file
    spec = find_spec("pybullet_data")
    if spec is not None and spec.submodule_search_locations:
        folder = Path(spec.submodule_search_locations[0])
        for file in sorted(folder.rglob("*.urdf")):
            if _MOVES.search(file.read_bytes()):
                found[f"pybullet_data/{file.relative_to(folder).as_posix()}"] = file
    return found


def _example_robot_data() -> Path | None:
    try:
        folder = distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data")
    except PackageNotFoundError:
        return None
    return Path(str(folder)) if Path(str(folder)).is_dir() else None
