"""``frobs migrate``: what it makes, and that it overwrites nothing."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_core.util.yaml import load_yaml
from frobs_rl_compat.migrate import Migration, migrate_package, migrate_yaml, read_package
from frobs_rl_compat.migrate.advice import note_the_task
from frobs_train.configuration.config import RunConfig

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
ORIGINALS = Path(__file__).parents[4] / "shared" / "frobs_rl" / "originals" / "frobs_rl_resources"
MAZE = "kobuki_maze/kobuki_maze_rl"
REACHER = "abb_irb140_reacher/abb_irb140_reacher"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return migrate_package(HERE / "gymnasium_package", tmp_path_factory.mktemp("made"), namespace="acme")


def read(migration, name: str) -> str:
    return next(path for path in migration.path.rglob(name) if path.is_file()).read_text("utf-8")


def test_the_plugin_has_the_packages_robot_and_limit_and_an_id_that_says_skeleton(made):
    assert made.path.name == "frobs-gymnasium-package"
    plugin = read(made, "plugin.py")
    assert 'id="acme/PlaneArmReachGymnasiumEnvSkeleton-v0"' in plugin
    assert "max_episode_steps=20" in plugin
    assert "PlaneArmReachEnv._send_action" in plugin
    assert "shoulder" in read(made, "gymnasium_package.urdf")
    assert "frobs_core:acme/PlaneArmReachGymnasiumEnvSkeleton-v0" in read(made, "README.md")


def test_spaces_are_quoted_and_the_files_of_numbers_are_copied(made):
    left = dict(made.left)
    action_space = "self.action_space = spaces.Box(low=-self.max_joint_step, high=self.max_joint_step, shape=(2,), dtype=np.float32)"
    assert "plugin.py (plane_arm_reach.py, line" in left[action_space]
    original = HERE / "gymnasium_package" / "config" / "reach_task.yaml"
    assert read(made, "config_reach_task.yaml") == original.read_text("utf-8")


def test_the_task_has_the_timing_and_places_of_the_old_hooks_but_no_old_code(made):
    task = read(made, "task.py")
    assert "control_timestep: ClassVar[float] = 0.04" in task
    assert "physics_timestep: ClassVar[float] = 0.002" in task
    for hook in ("_get_observation", "_get_reward", "_check_if_done", "_set_episode_init_params"):
        assert f"PlaneArmReachEnv.{hook}" in task
    assert "self.step_reward" not in task
    left = dict(made.left)
    assert "get_tool_pos" in left["other methods"]
    assert "arbitrary code cannot be translated" in left["the task"]
    compile(task, "task.py", "exec")


def test_the_training_file_becomes_a_run_configuration(made):
    config = RunConfig(**load_yaml(made.path / "train.yaml"))
    assert config.environment == "acme/PlaneArmReachGymnasiumEnvSkeleton-v0"
    assert config.algorithm == "td3"
    assert config.steps == 60
    assert config.algorithm_config["policy_kwargs"]["net_arch"] == [32, 32]


def test_the_report_says_what_was_carried_and_what_was_not(made):
    page = read(made, "MIGRATION.md")
    carried, left = page.split("## Left to do")
    assert "td3.yaml: training, noise, networks" in carried
    for what in (
        "ID PlaneArmReachGymnasiumEnv-v0",
        "joint_position",
        "goal.launch",
        "/plane_arm/goal_pos",
        "NormalizeObservationWrapper",
        "log_folder",
    ):
        assert what in left


def test_what_is_made_passes_its_own_lint(made):
    for command in (["check"], ["format", "--check"]):
        done = subprocess.run([sys.executable, "-m", "ruff", *command, made.path], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


def test_nothing_is_overwritten(made):
    before = sorted(made.path.parent.iterdir())
    with pytest.raises(ConfigurationError, match="exists"):
        migrate_package(HERE / "gymnasium_package", made.path.parent, namespace="acme")
    assert sorted(made.path.parent.iterdir()) == before


def test_a_package_without_its_robots_file_gets_a_replacement(tmp_path):
    (tmp_path / "task.py").write_text(
        "import moveit_commander\nfrom frobs_rl.envs import robot_BasicEnv\n"
        "class Arm(robot_BasicEnv.RobotBasicEnv):\n    def __init__(self):\n"
        "        super().__init__(pkg_name='nowhere', urdf_file='arm.urdf')\n"
    )
    migration = migrate_package(tmp_path, tmp_path / "made", name="other_arm")
    left = dict(migration.left)
    assert "nowhere" in left["the robot's file"]
    assert 'controller="trajectory"' in left["MoveIt"]
    assert "TODO" in read(migration, "robot.py")


def test_a_training_file_alone_becomes_a_run_configuration(tmp_path):
    migration = migrate_yaml(HERE / "old_gym_package" / "config" / "td3.yaml", tmp_path)
    assert RunConfig(environment="CartPole-v1", **load_yaml(migration.path)).algorithm == "td3"
    with pytest.raises(ConfigurationError, match="exists"):
        migrate_yaml(HERE / "old_gym_package" / "config" / "td3.yaml", tmp_path)


def test_a_training_file_that_continues_a_model_keeps_its_hyperparameters(tmp_path):
    file = tmp_path / "td3.yaml"
    text = (HERE / "old_gym_package" / "config" / "td3.yaml").read_text()
    assert "load_model: False" in text
    file.write_text(text.replace("load_model: False", "load_model: True"))
    migration = migrate_yaml(file, tmp_path)
    assert load_yaml(migration.path)["algorithm_config"]["policy_kwargs"]["net_arch"] == [32, 32]
    assert "starts with a new model" in dict(migration.left)["keys that are not supported"]


def test_a_task_file_of_the_example_repository_names_the_environment_that_takes_it(tmp_path):
    file = tmp_path / "reacher_task.yaml"
    file.write_text("irb120:\n  tolerance_goal_pos: 0.05\n")
    config = load_yaml(migrate_yaml(file, tmp_path).path)
    assert config["environment"] == "frobs/Irb120ReachLegacy-v0"
    assert config["environment_kwargs"] == {"config_file": str(file)}


def test_another_yaml_file_is_refused(tmp_path):
    file = tmp_path / "other.yaml"
    file.write_text("something: 1\n")
    with pytest.raises(ConfigurationError, match=r"model_params.*something"):
        migrate_yaml(file, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["other.yaml"]


def test_friction_and_lidar_of_wheels_are_carried_over(tmp_path):
    robot = read(migrate_package(EXAMPLES / "kobuki_maze_rl", tmp_path), "robot.py")
    names: dict = {"__file__": str(tmp_path / "robot.py")}
    exec(robot, names)
    kobuki = names["KOBUKI_MAZE_RL"]
    assert kobuki.friction["caster_front_link"] == 0.0
    assert kobuki.sensors["lidar"].rays == 8
    assert kobuki.sensors["lidar"].frame == "laser_link"


def test_a_lidar_that_cannot_be_used_leaves_the_robot_as_it_is(tmp_path):
    package = tmp_path / "kobuki_maze_rl"
    shutil.copytree(EXAMPLES / "kobuki_maze_rl", package)
    file = package / "urdf" / "kobuki_lidar.urdf.xacro"
    file.write_text(file.read_text().replace("<update_rate>100", "<pose>0 0 0 0 1 0</pose><update_rate>100"))
    migration = migrate_package(package, tmp_path / "made")
    assert "rotated" in dict(migration.left)["the lidar"]
    assert "differential_drive=DifferentialDrive(" in read(migration, "robot.py")


def test_a_package_without_a_launch_file_is_migrated_too(tmp_path):
    package = tmp_path / "old_gym_package"
    shutil.copytree(HERE / "old_gym_package", package)
    shutil.rmtree(package / "launch")
    migration = migrate_package(package, tmp_path / "made")
    assert "goal.launch" not in dict(migration.left)
    assert "observation_elements_vary" in dict(migration.left)["the tool never moves along z"]


@pytest.mark.parametrize(
    ("package", "id", "nearest"),
    [
        (EXAMPLES / "kobuki_maze_rl", None, "frobs/KobukiMazeLegacy-v0"),
        (EXAMPLES / "abb_irb120_reacher", None, "frobs/Irb120ReachLegacy-v0"),
        *(
            pytest.param(ORIGINALS / folder, id, nearest, marks=pytest.mark.needs("originals"))
            for folder, id, nearest in (
                (MAZE, "KobukiMazeEnv-v0", "frobs/KobukiMazeLegacy-v0"),
                (MAZE, "KobukiDynamicEnv-v3", "frobs/KobukiDynamicLegacy-v0"),
                (MAZE, "KobukiEmptyEnv-v0", "frobs/KobukiEmptyLegacy-v0"),
                (REACHER, "ABBIRB140VelReacherEnv-v0", "frobs/Irb140ReachVelocityLegacy-v0"),
                (REACHER, "ABBIRB140ReacherPosEnv-v0", "frobs/Irb140ReachLegacy-v0"),
            )
        ),
    ],
)
def test_the_report_names_the_id_that_reproduces_an_example(package, id, nearest):
    assert nearest in gymnasium.registry
    old = read_package(package, id)
    migration = Migration(old.name, package)
    note_the_task(old, None, migration)
    assert dict(migration.left)["the task"].startswith(f"{nearest} reproduces FRobs_RL's example")
