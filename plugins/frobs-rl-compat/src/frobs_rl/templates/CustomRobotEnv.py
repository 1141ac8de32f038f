"""Template of a robot's environment: which model, which controllers, where in the world. A task's environment inherits it.

To copy: change the name of the class and the values below.
"""

from frobs_rl.envs import robot_BasicEnv

__all__ = ["CCustomRobotEnv", "CustomRobotEnv"]


class CustomRobotEnv(robot_BasicEnv.RobotBasicEnv):
    """A robot, for all environments that use it."""

    def __init__(self) -> None:
        # Gazebo, if the environment launches it
        launch_gazebo = False
        gazebo_init_paused = True
        gazebo_use_gui = True
        gazebo_recording = False
        gazebo_freq = 100  # [Hz] of /clock
        gazebo_max_freq = None  # real-time factor: 10 is ten times real time
        gazebo_timestep = None  # [s]

        # its world: a path, or a package and a file of it
        world_path = None
        world_pkg = None
        world_filename = None

        # the robot, if the environment spawns it
        spawn_robot = False
        model_name_in_gazebo = "robot"
        namespace = "/robot"
        pkg_name = None
        urdf_file = None
        urdf_folder = "/urdf"
        urdf_xacro_args = None  # ["name:=value"]
        controller_file = None
        controller_list = None
        rob_state_publisher_max_freq = None  # [Hz]
        model_pos_x, model_pos_y, model_pos_z = 0.0, 0.0, 0.0  # [m]
        model_ori_x, model_ori_y, model_ori_z, model_ori_w = 0.0, 0.0, 0.0, 1.0

        reset_controllers = False  # at the beginning of each episode
        reset_mode = 1  # 1: reset the world; 2: the simulation, with its clock
        step_mode = 1  # 1: let it run while an action is sent; 2: step num_gazebo_steps times
        num_gazebo_steps = 1

        super().__init__(
            launch_gazebo=launch_gazebo,
            gazebo_init_paused=gazebo_init_paused,
            gazebo_use_gui=gazebo_use_gui,
            gazebo_recording=gazebo_recording,
            gazebo_freq=gazebo_freq,
            world_path=world_path,
            world_pkg=world_pkg,
            world_filename=world_filename,
            gazebo_max_freq=gazebo_max_freq,
            gazebo_timestep=gazebo_timestep,
            spawn_robot=spawn_robot,
            model_name_in_gazebo=model_name_in_gazebo,
            namespace=namespace,
            pkg_name=pkg_name,
            urdf_file=urdf_file,
            urdf_folder=urdf_folder,
            controller_file=controller_file,
            controller_list=controller_list,
            urdf_xacro_args=urdf_xacro_args,
            rob_state_publisher_max_freq=rob_state_publisher_max_freq,
            model_pos_x=model_pos_x,
            model_pos_y=model_pos_y,
            model_pos_z=model_pos_z,
            model_ori_x=model_ori_x,
            model_ori_y=model_ori_y,
            model_ori_z=model_ori_z,
            model_ori_w=model_ori_w,
            reset_controllers=reset_controllers,
            reset_mode=reset_mode,
            step_mode=step_mode,
            num_gazebo_steps=num_gazebo_steps,
        )
        # publishers and subscribers of the robot

    def _check_subs_and_pubs_connection(self) -> bool:
        """Wait until what the robot publishes has arrived."""
        return True


CCustomRobotEnv = CustomRobotEnv  # FRobs_RL's documentation has both names
