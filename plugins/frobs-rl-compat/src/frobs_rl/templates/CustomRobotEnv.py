"""Template of a robot's environment: its model, its controllers and its pose. A task's environment inherits from it.

To copy it, change the name of the class and the values below.
"""

from frobs_rl.envs import robot_BasicEnv

__all__ = ["CCustomRobotEnv", "CustomRobotEnv"]


class CustomRobotEnv(robot_BasicEnv.RobotBasicEnv):
    """A robot, for all environments that use it."""

    def __init__(self) -> None:
        super().__init__(
            # Gazebo, if the environment launches it
            launch_gazebo=False,
            gazebo_init_paused=True,
            gazebo_use_gui=True,
            gazebo_recording=False,
            gazebo_freq=100,  # [Hz] of /clock
            gazebo_max_freq=None,  # real-time factor: 10 is ten times real time
            gazebo_timestep=None,  # [s]
            # its world: a path, or a package and a file in it
            world_path=None,
            world_pkg=None,
            world_filename=None,
            # the robot, if the environment spawns it
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
            reset_controllers=False,  # at the beginning of each episode
            reset_mode=1,  # 1: reset the world; 2: the simulation, with its clock
            step_mode=1,  # 1: let it run while an action is sent; 2: step num_gazebo_steps times
            num_gazebo_steps=1,
        )
        # create publishers and subscribers of the robot here

    def _check_subs_and_pubs_connection(self) -> bool:
        """Wait until the robot's topics have sent a message."""
        return True


CCustomRobotEnv = CustomRobotEnv  # FRobs_RL's documentation uses both names
