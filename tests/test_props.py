"""Articulated objects without a controller, in environments and in scenes."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import frobs_core.plugins
import frobs_devkit.testing.simulator
from frobs_core.description import Body, Camera, Contact, Prop, Scene
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import Pose, Sphere
from frobs_core.util.errors import ModelFileError, SceneError
from frobs_tasks_reach.reach import Reach

MODEL = str(Path(frobs_devkit.testing.simulator.__file__).with_name("urdf") / "kit_drawer.urdf")
DRAWER = Prop(model=MODEL, pose=Pose((0.0, 0.9, 0.0)))


class ReachBesideDrawer(Reach):
    def scene(self) -> Scene:
        return replace(
            super().scene(),
            props={"drawer": DRAWER},
            contacts={"drawer_hit": Contact(first="drawer/drawer", second="robot")},
            cameras={"inside": Camera(pos=(0.5, 0.0, 0.2), target=(0.0, 0.0, 0.0), frame="drawer/drawer")},
        )


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_a_drawer_in_an_environment_opens_only_when_it_is_pulled(simulator: str) -> None:
    task = replace(frobs_core.plugins.get_record("task", "reach"), entry_point=f"{__name__}:ReachBesideDrawer")
    with closing(
        RobotEnv(task=task, robot="irb120", controller="joint_delta_position", simulator=simulator, render_mode=None)
    ) as env:
        env.reset(seed=0)
        drawer = env.simulation.robots["drawer"]
        for _ in range(25):
            env.step(np.zeros(6, np.float32))
        assert drawer.joint_positions[0, 0] == pytest.approx(0.0, abs=1e-4)
        for _ in range(20):  # 0.8 s
            env.simulation.apply_wrench("drawer/handle", np.array([[4.0, 0.0, 0.0]]), np.zeros((1, 3)))
            env.step(np.zeros(6, np.float32))
        # The solution of 2.5 kg · a = 4 N − 8 N·s/m · v
        rate = 8.0 / 2.5
        opened = 0.5 * (0.8 - (1.0 - np.exp(-0.8 * rate)) / rate)
        assert drawer.joint_positions[0, 0] == pytest.approx(opened, rel=0.02)
        env.reset(seed=1)
        assert drawer.joint_positions[0, 0] == pytest.approx(0.0, abs=1e-6)


def test_a_prop_needs_a_name_of_its_own() -> None:
    ball = Body(geometry=Sphere(0.1))
    robot = DRAWER.placement("robot")
    for scene in (Scene(props={"drawer": DRAWER}, bodies={"drawer": ball}), Scene(props={"robot": DRAWER})):
        with pytest.raises(SceneError, match="name as a robot or body"):
            scene.all_robots({"robot": robot})


def test_a_prop_starts_where_its_home_is_and_a_missing_file_is_named() -> None:
    placement = replace(DRAWER, home={"slide": 0.2}).placement("drawer")
    assert placement.robot.home == {"slide": 0.2}
    with pytest.raises(ModelFileError, match=r"no_such\.urdf"):
        Prop(model="no_such.urdf").placement("drawer")
