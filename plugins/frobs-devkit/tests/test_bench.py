"""The benchmark measures what it says; how fast that is, no test asks."""

from __future__ import annotations

import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_devkit.bench import PARTS, bench

ID = "frobs_core:frobs/Irb120Reach-v0"


@pytest.mark.parametrize("num_envs", [1, 3])
def test_the_parts_of_a_step_are_measured_beside_the_bare_engine(num_envs):
    result = bench(ID, num_envs=num_envs, steps=60)
    assert tuple(result.parts) == PARTS
    assert result.decimation == 20
    assert result.ratio == result.step_seconds / result.bare_seconds
    assert result.parts["engine"] > 0.0
    assert result.parts["engine"] < result.step_seconds * 2


@pytest.mark.slow
def test_gazebo_which_has_no_bare_engine_is_measured_alone(real_gazebo):
    result = bench(ID, steps=10, simulator="gazebo")
    assert (result.bare_seconds, result.ratio) == (None, None)
    assert result.steps_per_second == pytest.approx(1.0 / result.step_seconds)


def test_the_bare_engine_ends_where_the_environment_does():
    from frobs_core.kernel.env import RobotEnv

    env = RobotEnv(task="reach", robot="irb120", controller="joint_delta_position")
    env.reset(seed=0)
    bare = env.simulation.bare_engine()
    for _ in range(5):
        env.robot.command(env.controller.apply(env.action_space.sample()[None].astype(float)))
        bare.load(env.simulation.snapshot())
        env.simulation.step(20)
        bare.step(20)
        assert (bare._data.qpos == env.simulation.native.batch.bind("qpos")[0]).all()
    env.close()


@pytest.mark.parametrize("num_envs", [1, 3])
def test_the_bare_engine_casts_the_rays_that_the_environment_casts(num_envs, monkeypatch):
    from frobs_sim_mujoco.simulation import BareMujoco

    cast, original = [], BareMujoco.rays

    def rays(self, origins, directions, max_range):
        cast.append((directions.shape, max_range))
        original(self, origins, directions, max_range)

    monkeypatch.setattr(BareMujoco, "rays", rays)
    bench("frobs_core:frobs/KobukiMaze-v0", num_envs=num_envs, steps=10)
    assert set(cast) == {((num_envs, 8, 3), 30.0)}
    assert len(cast) >= 10


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(ConfigurationError, match="not a FRobs environment"):
        bench("CartPole-v1")
    with pytest.raises(ConfigurationError, match="'CartPole-v1' cannot be built with simulator='mujoco'"):
        bench("CartPole-v1", simulator="mujoco")
    with pytest.raises(ConfigurationError, match="steps is 1; it must be a whole number of at least 10"):
        bench(ID, steps=1)
