"""The simulators ``ros2`` and ``safe``."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import pytest
from ros2_processes import Start

from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Placement, Scene
from frobs_core.models import Box
from frobs_core.plugins import get_record
from frobs_core.util.errors import ConfigurationError, ParameterValueError, SimulationError, UnknownParameterError
from frobs_ros2.simulation import Ros2Simulation

ID = "frobs/Irb120Reach-v0"


@pytest.mark.needs("ros2")
def test_policy_acts_on_a_robot_behind_topics(ros2: Start) -> None:
    ros2("frobs", "ros2", "serve", ID).wait_for("serving")
    result = ros2("node", "use_simulator.py", ID).result()
    assert result["successes"] >= 1
    assert result["homing_error"] < 0.05
    assert 0.0 <= result["measurement_age"] < 5.0
    assert result["missed"] >= 0.0


@pytest.mark.needs("ros2")
def test_stamps_of_another_clock_are_reported(ros2: Start) -> None:
    ros2("frobs", "ros2", "serve", ID).wait_for("serving")
    result = ros2("node", "use_simulator.py", ID, "--wall-clock").result()
    assert "the stamps of joint_states differ from the clock of this node by" in result["error"]
    assert "use_sim_time" in result["error"]


@pytest.mark.needs("ros2")
@pytest.mark.slow
def test_commands_use_the_robot_like_a_simulation(ros2: Start, tmp_path: Path) -> None:
    ros2("frobs", "ros2", "serve", ID).wait_for("serving")
    options = ("--policy", "pretrained", "--simulator", "ros2", "--json", "--episodes")
    assert ros2("frobs", "evaluate", ID, *options, 2).result()["success_rate"] >= 0.5
    recorded = ros2("frobs", "record", ID, *options, 2, "--out", tmp_path / "data").result()
    assert (recorded["episodes"], recorded["frames"]) == (2, 100)
    assert recorded["success_rate"] >= 0.5


@pytest.mark.needs("ros2", "rendering")
def test_images_come_from_topics(ros2: Start) -> None:
    ros2("frobs", "ros2", "serve", ID).wait_for("serving")
    result = ros2("node", "use_simulator.py", ID, "--image").result()
    shape, contrast = result["image"]
    assert shape == [1, 48, 64, 3]
    assert contrast > 5.0


class NodeWithoutRos:
    """A node without ROS, because rclpy is not installed everywhere. It delivers one message of each known topic."""

    messages: ClassVar[dict[str, Any]] = {}

    def __init__(self, *arguments: Any) -> None:
        now = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=10**9))
        self.node = SimpleNamespace(get_clock=lambda: now, count_publishers=lambda topic: 0)
        self.callbacks: dict[str, Any] = {}
        self.is_open = True
        nodes.append(self)

    def publisher(self, kind: str, topic: str) -> Any:
        return SimpleNamespace(get_subscription_count=lambda: 1)

    def subscribe(self, kind: str, topic: str, callback: Any) -> None:
        self.callbacks[topic] = callback

    def spin(self) -> None:
        """Deliver nothing."""

    def spin_until(self, condition: Any, seconds: float) -> bool:
        for topic, message in self.messages.items():
            self.callbacks[topic](message)
        return bool(condition())

    def ok(self) -> bool:
        return self.is_open

    def close(self) -> None:
        self.is_open = False


nodes: list[NodeWithoutRos] = []


@pytest.fixture
def without_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes.clear()
    monkeypatch.setattr("frobs_ros2.simulation.Node", NodeWithoutRos)


@pytest.mark.parametrize(
    ("kwargs", "error", "message"),
    [
        ({"safety": {"speed": 2.0}}, ParameterValueError, "safety: speed is 2.0"),
        ({"namespaces": {"robbot": "left"}}, UnknownParameterError, "namespaces.*robbot"),
        ({"bodies": {"cube": "/cube"}}, UnknownParameterError, "bodies.*cube"),
    ],
)
@pytest.mark.usefixtures("without_ros")
def test_setting_that_cannot_be_used_is_named_and_the_node_ended(
    kwargs: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        gym.make(f"frobs_core:{ID}", simulator="ros2", simulator_kwargs=kwargs, disable_env_checker=True)
    assert not any(node.is_open for node in nodes)


def joint_state(position: float = 0.0, seconds: int = 1) -> Any:
    header, names = SimpleNamespace(stamp=SimpleNamespace(sec=seconds, nanosec=0)), [f"joint_{i}" for i in range(1, 7)]
    return SimpleNamespace(header=header, name=names, position=[position] * 6, velocity=[], effort=[])


def simulation_of(bodies: dict[str, str], **kwargs: Any) -> Ros2Simulation:
    robot = get_record("robot", "irb120").load()
    placement = Placement(robot=robot, model=robot.read_model(), command_mode=CommandMode.POSITION)
    scene = Scene(bodies={name: Body(geometry=Box((0.1, 0.1, 0.1)), mass=0.1) for name in bodies})
    return Ros2Simulation({"robot": placement}, scene, num_envs=1, physics_timestep=0.01, bodies=bodies, **kwargs)


@pytest.mark.usefixtures("without_ros")
@pytest.mark.parametrize(
    ("message", "reason"),
    [(joint_state(np.nan), "is not finite"), (joint_state(seconds=0), "is 1 s old")],
    ids=["not finite", "old"],
)
def test_no_command_is_computed_from_a_measurement_that_cannot_be_used(
    monkeypatch: pytest.MonkeyPatch, message: Any, reason: str
) -> None:
    monkeypatch.setattr(NodeWithoutRos, "messages", {"joint_states": joint_state(0.5)})
    simulation = simulation_of({})
    assert simulation.robots["robot"].joint_positions.tolist() == [[0.5] * 6]
    monkeypatch.setattr(NodeWithoutRos, "messages", {"joint_states": message})
    with pytest.raises(SimulationError, match=f"no measurement could be used for 5 s: a measurement .*{reason}"):
        simulation.reset()


@pytest.mark.usefixtures("without_ros")
@pytest.mark.parametrize(("encoding", "reason"), [("32FC1", "is for depth"), ("yuv422", "is not supported")])
def test_image_without_colors_is_an_error(monkeypatch: pytest.MonkeyPatch, encoding: str, reason: str) -> None:
    monkeypatch.setattr(NodeWithoutRos, "messages", {"joint_states": joint_state()})
    simulation_of({}, cameras={"front": "/front"})
    image = SimpleNamespace(encoding=encoding, height=1, width=1, step=4, data=bytes(4), is_bigendian=0)
    with pytest.raises(SimulationError, match=f"'{encoding}' {reason}"):
        nodes[-1].callbacks["/front"](image)


@pytest.mark.usefixtures("without_ros")
def test_body_whose_pose_does_not_arrive_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    joints = joint_state()
    monkeypatch.setattr(NodeWithoutRos, "messages", {"joint_states": joints})
    with pytest.raises(SimulationError, match=r"no pose of these bodies arrived: 'box' \(/box_pose\)"):
        simulation_of({"box": "/box_pose"})
    pose = SimpleNamespace(
        position=SimpleNamespace(x=0.4, y=0.1, z=0.0), orientation=SimpleNamespace(w=1.0, x=0.0, y=0.0, z=0.0)
    )
    monkeypatch.setattr(NodeWithoutRos, "messages", {"joint_states": joints, "/box_pose": SimpleNamespace(pose=pose)})
    simulation: Any = simulation_of({"box": "/box_pose"})
    assert simulation.bodies["box"].pose[0][0].tolist() == [0.4, 0.1, 0.0]
    simulation._heard["box"] -= 6.0
    simulation.hold = lambda: None  # without ROS, there are no messages
    with pytest.raises(SimulationError, match=r"for 5 s, no pose of these bodies arrived: 'box' \(/box_pose\)"):
        simulation.receive()


@pytest.mark.usefixtures("without_ros")
def test_camera_that_falls_silent_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    image = SimpleNamespace(encoding="rgb8", height=1, width=1, step=3, data=bytes(3), is_bigendian=0)
    monkeypatch.setattr(NodeWithoutRos, "messages", {"joint_states": joint_state(), "/front": image})
    simulation: Any = simulation_of({}, cameras={"front": "/front"})
    assert simulation.render(camera="front", size=(2, 2)).shape == (1, 2, 2, 3)
    monkeypatch.setattr(NodeWithoutRos, "messages", {})
    simulation._heard["images of front"] -= 6.0
    with pytest.raises(SimulationError, match="the images of the camera 'front' no longer arrive"):
        simulation.render(camera="front", size=(2, 2))


def test_rules_protect_any_paced_simulation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[3] / "tests" / "contracts"))
    import paced_plugin

    log = tmp_path / "changes.jsonl"
    settings = {"speed": 0.1, "slow_start": 0.0, "max_age": 60.0, "log": str(log)}
    kwargs = {"inner": paced_plugin.RECORD, "safety": settings}
    env: Any = gym.make(f"frobs_core:{ID}", simulator="safe", simulator_kwargs=kwargs, disable_env_checker=True)
    try:
        env.reset(seed=0)
        robot = env.unwrapped.robot
        before = robot.joint_positions.copy()
        for _ in range(3):
            *_, info = env.step(np.ones(6, np.float32))
        assert np.abs(robot.joint_positions - before).max() <= 4 * 0.04 * 0.1 * robot.velocity_limit.max()
        assert robot.rules.counts["velocity"] == 3
        assert '"rule": "velocity"' in log.read_text("utf-8")
        assert info["frobs/missed_deadlines"] >= 0.0
        robot.command(np.full((1, 6), np.nan))
        env.unwrapped.simulation.step(1)
        assert robot.rules.counts["finite"] == 1
        env.unwrapped.simulation.hold()
        assert env.unwrapped.simulation.measurement_age.shape == (1,)
    finally:
        env.close()


def test_measurements_that_are_fresh_but_rarer_than_steps_do_not_make_the_robot_hold(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[3] / "tests" / "contracts"))
    import paced_plugin

    kwargs = {"inner": paced_plugin.RECORD, "safety": {"slow_start": 0.0}}
    env: Any = gym.make(f"frobs_core:{ID}", simulator="safe", simulator_kwargs=kwargs, disable_env_checker=True)
    ages = iter([0.02, 0.06, 0.1, 0.02, 0.06, 9.0])
    age = property(lambda simulation: np.array([next(ages)]))
    monkeypatch.setattr(paced_plugin.RECORD.load(), "measurement_age", age)
    try:
        env.reset(seed=0)
        rules = env.unwrapped.robot.rules
        for _ in range(5):
            env.step(np.zeros(6, np.float32))
        assert rules.counts["measurement"] == 0
        env.step(np.zeros(6, np.float32))
        assert rules.held == "a measurement was repeated"
    finally:
        env.close()


def test_simulator_that_is_not_paced_is_rejected() -> None:
    with pytest.raises(ConfigurationError, match="not a paced simulator"):
        gym.make(f"frobs_core:{ID}", simulator="safe", simulator_kwargs={"inner": "mujoco"}, disable_env_checker=True)
