"""Template for a robot environment, which defines the robot's model, controllers and pose.

Task environments inherit from the robot environment. After copying this template, change the class name and the values
below.
"""

from frobs_rl.envs import robot_BasicEnv

__all__ = ["CCustomRobotEnv", "CustomRobotEnv"]


class CustomRobotEnv(robot_BasicEnv.RobotBasicEnv):
    """Base class for the task environments of one robot."""

    def __init__(self) -> None:
        super().__init__(
            # Gazebo settings for environments that launch Gazebo
            launch_gazebo=False,
            gazebo_init_paused=True,
            gazebo_use_gui=True,
            gazebo_recording=False,
            gazebo_freq=100,  # [Hz] of /clock
            gazebo_max_freq=None,  # maximum real-time factor, such as 10
            gazebo_timestep=None,  # [s]
            # Gazebo's world file: either a path, or a package and a file name in that package
            world_path=None,
            world_pkg=None,
            world_filename=None,
            # robot settings for environments that spawn the robot
            spawn_robot=False,
            model_name_in_gazebo="robot",
            namespace="/robot",
            pkg_name=None,
            urdf_file=None,
            urdf_folder="/urdf",
            urdf_xacro_args=None,  # ["name:=value"]
            controller_file=None,
            controller_list=None,
            rob_state_publisher_max_freq=None,  # [Hz]
            model_pos_x=0.0,  # [m]
            model_pos_y=0.0,
            model_pos_z=0.0,
            model_ori_x=0.0,
            model_ori_y=0.0,
            model_ori_z=0.0,
            model_ori_w=1.0,
            reset_controllers=False,  # whether to reset the controllers at the beginning of each episode
            reset_mode=1,  # 1: reset the models; 2: reset the whole simulation, including its clock
            step_mode=1,  # 1: unpause Gazebo during an action; 2: run num_gazebo_steps physics steps per action
            num_gazebo_steps=1,
        )
        # create the robot's publishers and subscribers here

    def _check_subs_and_pubs_connection(self) -> bool:
        """Wait until messages have arrived on the robot's topics, and return True."""
        return True


CCustomRobotEnv = CustomRobotEnv  # alias, because FRobs_RL's documentation uses both spellings
