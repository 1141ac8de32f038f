"""Each parameter shows in the motion: of its own environment, with the value that was drawn, and again with the seed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sliding import RECORD

from frobs_core import plugins
from frobs_core.plugins.records import Level
from frobs_core.sensing.randomization import physical_parameters

N = 4
SHOULDER = 1  # joint 2, which carries the arm


def claiming(parameter: str) -> Any:
    """Return a mark for each installed simulator that claims to be able to randomise a parameter."""
    needed = physical_parameters().get(parameter)
    names = [
        name if name == "mujoco" else pytest.param(name, marks=pytest.mark.slow)
        for name, record in plugins.records("simulator").items()
        if name != "gazebo"  # which most machines lack; the kit looks at its parameters
        and not record.is_paced  # they have a single environment
        and (needed is None or record.capabilities.get(needed, Level.UNSUPPORTED))  # type: ignore[attr-defined]
    ]
    return pytest.mark.parametrize("simulator", names)


def play(env: Any, steps: int, action: Any = 0.0, seed: int = 3) -> np.ndarray:
    """Return the joint positions after each step, (steps + 1, num_envs, dof)."""
    env.reset(seed=seed)
    trace = [env.robot.joint_positions.copy()]
    for _ in range(steps):
        env.step(np.broadcast_to(action, (env.num_envs, *env.single_action_space.shape)))
        trace.append(env.robot.joint_positions.copy())
    return np.array(trace)


def sag(env: Any) -> np.ndarray:
    """Return how far the shoulder hangs below home, (num_envs,) [rad]."""
    return play(env, 25)[-1, :, SHOULDER] - env.robot.home[:, SHOULDER]


def factors(env: Any, name: str, nominal: float) -> np.ndarray:
    values = env.randomization.values[name] / nominal
    assert len(set(values.tolist())) == N, "each environment has its own"
    return values


@claiming("mass")
def test_a_heavier_arm_hangs_lower(make, simulator):
    """The torque of gravity is in proportion to the masses, and the drives give way in proportion to the torque."""
    env = make(N, {"mass": {"scale": [0.5, 2.0], "shared": True}}, simulator=simulator)
    nominal = sag(make(N, simulator=simulator))
    found = sag(env)
    link = "mass/robot/link_3"
    assert found / nominal == pytest.approx(factors(env, link, 2.944), rel=0.02)
    assert (sag(env) == found).all(), "the same seed repeats"


@claiming("mass")
def test_a_payload_hangs_on_one_link(make, simulator):
    env = make(N, {"mass": {"target": "link_6", "add": [0.5, 3.0]}}, simulator=simulator)
    nominal = sag(make(N, simulator=simulator))
    payload = env.reset(seed=3)[1]["frobs/randomization"]["mass/robot/link_6"] - 0.137
    assert np.argsort(payload).tolist() == np.argsort(sag(env)).tolist()
    assert (sag(env) > nominal * 1.05).all()
    assert env.randomization.values.keys() == {"mass/robot/link_6"}


@claiming("stiffness")
def test_a_stiffer_drive_hangs_less(make, simulator):
    env = make(N, {"stiffness": {"scale": [0.5, 2.0], "shared": True}}, simulator=simulator)
    nominal = make(N, simulator=simulator)
    found = sag(env)
    kp = nominal.robot.drive_gains()[0][0, 0]
    assert sag(nominal) / found == pytest.approx(factors(env, "stiffness/robot/joint_1", kp), rel=0.02)
    assert (sag(env) == found).all()


@claiming("damping")
def test_a_damped_drive_is_slower(make, simulator):
    env = make(N, {"damping": {"scale": [0.3, 3.0], "shared": True}}, simulator=simulator)
    expect_slower_by(env, make(N, simulator=simulator), "damping/robot/joint_1")


@claiming("joint_damping")
def test_a_damped_joint_is_slower(make, simulator):
    env = make(N, {"joint_damping": {"add": [20.0, 300.0], "target": "joint_1"}}, simulator=simulator)
    nominal = make(N, simulator=simulator)
    expect_slower_by(env, nominal, "joint_damping/robot/joint_1")
    assert (play(env, 2, FIRST_JOINT)[:, :, 0] < play(nominal, 2, FIRST_JOINT)[:, :, 0])[1:].all()


FIRST_JOINT = np.array([1.0, 0, 0, 0, 0, 0])


def expect_slower_by(env: Any, nominal: Any, name: str) -> None:
    """Expect joint 1 to lag behind the more, the more there is of a parameter."""
    moved = play(env, 2, FIRST_JOINT)[-1, :, 0]
    values = env.randomization.values[name]
    assert len(set(values.tolist())) == N
    assert np.argsort(values).tolist() == np.argsort(-moved).tolist()
    more = values > nominal.simulation.parameter(name.partition("/")[0], "robot")[:, 0]
    assert ((moved < play(nominal, 2, FIRST_JOINT)[-1, :, 0]) == more).all()
    assert (play(env, 2, FIRST_JOINT)[-1, :, 0] == moved).all()


@claiming("gravity")
def test_gravity_pulls_in_its_own_direction(make, simulator):
    env = make(N, {"gravity": {"scale": [0.5, 2.0]}}, simulator=simulator)
    nominal = sag(make(N, simulator=simulator))
    found = sag(env)
    assert found / nominal == pytest.approx(env.randomization.values["gravity"][:, 2] / -9.81, rel=0.02)
    tilted = make(N, {"gravity": {"add": {"normal": [2.0, 2.0, 0.0]}}}, simulator=simulator)
    turned = play(tilted, 25)[-1, :, 0] - tilted.robot.home[:, 0]  # upright, joint 1 feels only a sideways pull
    sideways = tilted.randomization.values["gravity"][:, 1]
    assert (np.sign(turned) == np.sign(sideways)).all()
    assert (sag(env) == found).all()


@claiming("friction")
def test_a_box_slides_by_the_friction_of_its_environment(make, simulator, monkeypatch):
    known = plugins.get_record
    monkeypatch.setattr(plugins, "get_record", lambda kind, name: RECORD if name == "sliding" else known(kind, name))
    env = make(
        N,
        {
            "friction": {"target": ["box", "floor"], "set": [0.05, 0.25]},
            "gravity": {"set": {"uniform": [[3.0, 0.0, -9.81], [3.0, 0.0, -9.81]]}},
        },
        task="sliding",
        simulator=simulator,
    )
    first, _ = env.reset(seed=3)
    for _ in range(25):
        slid = env.step(np.zeros((N, 6)))[0] - first
    values = env.randomization.values
    between = np.maximum(values["friction/box"], values["friction/floor"])
    assert slid[:, 0] == pytest.approx(0.5 * (3.0 - between * 9.81), rel=0.1, abs=0.02)  # in 1 s


@claiming("action_delay")
@pytest.mark.parametrize("controller", ["joint_delta_position", "joint_position", "joint_velocity"])
def test_an_action_takes_effect_late(make, simulator, controller):
    """The motion is that without delay, some control steps later: weightless, so that waiting changes nothing."""
    weightless = {"gravity": {"scale": 0}}
    keywords = {"simulator": simulator, "controller": controller}
    at_once = play(make(N, weightless, **keywords), 8, 0.3)
    env = make(N, {**weightless, "action_delay": {"steps": [0, 3]}}, **keywords)
    late = play(env, 8, 0.3, seed=4)
    delays = env.randomization.values["action_delay"].astype(int)
    assert len(set(delays.tolist())) > 1
    for i, delay in enumerate(delays):
        assert late[delay:, i] == pytest.approx(at_once[: 9 - delay, i], abs=1e-9)
    assert (play(env, 8, 0.3, seed=4) == late).all()
