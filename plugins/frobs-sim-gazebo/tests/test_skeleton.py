from __future__ import annotations

import numpy as np

from frobs_core.models import load_model
from frobs_robots_abb.irb120 import IRB120
from frobs_sim_gazebo.skeleton import Skeleton


def test_the_armature_of_a_rotating_joint_is_inertia_about_its_axis() -> None:
    model = load_model(IRB120.model)
    armatures = {joint.name: 3.0 * (joint.name == "joint_2") for joint in model.joints}
    plain, geared = Skeleton(model).masses(), Skeleton(model, armatures).masses()
    added = [after.inertia - before.inertia for before, after in zip(plain, geared, strict=True)]
    axis = Skeleton(model).axes[1]
    assert [np.allclose(each, 0.0) for each in added] == [True, True, False, True, True, True, True]
    assert np.allclose(added[2], 3.0 * np.outer(axis, axis))
