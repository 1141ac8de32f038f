"""FRobs_RL's ``RobotBasicEnv``: a robot in Gazebo or the bridge, as a Gymnasium environment.

It is separate from FRobs's five component kinds, and meant for porting. Subclasses implement six hooks.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import weakref
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import gymnasium as gym

from frobs_core.errors import ResetNeededError
from frobs_ros import master, processes
from frobs_ros.environment import use_ros
from frobs_ros.gazebo import launch, physics, world
from frobs_ros.interrupts import interruptible
from frobs_ros.log import LOG, constructing, or_raise, refused
from frobs_ros.names import join
from frobs_ros.robot_settings import RobotSettings
from frobs_ros.ros_controllers import reset_controllers_srv
from frobs_ros.ros_spawn import spawn_model_in_gazebo


def _whole(init: Callable[..., None]) -> Callable[..., None]:
    """Make the outermost constructor of an environment atomic: an error ends all processes that it has started."""

    @functools.wraps(init)
    def construct(self: RobotBasicEnv, *args: Any, **kwargs: Any) -> None:
        if self._is_constructing:
            init(self, *args, **kwargs)
            return
        self._is_constructing = True
        with interruptible(), constructing(), processes.collected() as started:
            init(self, *args, **kwargs)
        self._is_constructing = False
        self._processes = started
        self._open.add(self)

    return construct


class RobotBasicEnv(gym.Env[Any, Any]):
    """Base class of environments whose robot is in a ROS graph.

    Depending on its arguments, the constructor launches the simulation, sets its speed and time step, spawns the robot
    and resets its controllers, in this order. :meth:`close` ends only the processes that it has started; an error ends
    them at once. Subclasses set the spaces. If a model cannot be spawned, or a node, launch file or controller cannot
    be started, while the constructor of a subclass runs, the constructor raises the reason.

    A step in mode 1 unpauses the simulation while :meth:`_send_action` runs, so its simulated duration is that of the
    call times the real-time factor. A step in mode 2 always lasts ``num_gazebo_steps`` physics steps.

    Args:
        launch_gazebo: Whether to launch the simulation; see :func:`frobs_ros.ros_gazebo.launch_Gazebo`.
        gazebo_init_paused: Whether the simulation starts paused.
        gazebo_use_gui: Whether the simulation has a window.
        gazebo_recording: Whether the simulation records its state.
        gazebo_freq: Rate of the topic /clock [Hz].
        world_path: A world file.
        world_pkg: A ROS package with a world file; used if no path is given.
        world_filename: The world file in the package.
        gazebo_max_freq: Maximum real-time factor: 1 is real time, 10 ten times as fast.
        gazebo_timestep: Physics time step [s].
        spawn_robot: Whether to spawn the robot; see :func:`frobs_ros.ros_spawn.spawn_model_in_gazebo`.
        model_name_in_gazebo: Name of the robot in the simulation.
        namespace: Namespace of the robot's topics and services.
        pkg_name: ROS package with the robot's files.
        urdf_file: URDF or xacro file of the robot.
        urdf_folder: Folder of that file in the package.
        controller_file: YAML file of the controllers in the package's folder ``config``.
        controller_list: Names of the controllers.
        urdf_xacro_args: Arguments of the xacro file: ``["effort:=true"]``.
        rob_state_publisher_max_freq: Maximum rate of the state publisher [Hz].
        rob_st_term: Whether to run the state publisher in an xterm.
        model_pos_x: Initial position along x [m].
        model_pos_y: Initial position along y [m].
        model_pos_z: Initial position along z [m].
        model_ori_x: x of the initial orientation, a unit quaternion; four zeros, the default, mean no rotation.
        model_ori_y: y of the quaternion.
        model_ori_z: z of the quaternion.
        model_ori_w: w, the scalar part of the quaternion.
        reset_controllers: Whether each reset stops and restarts the controllers.
        reset_mode: 1 resets models, 2 also the clock.
        step_mode: 1 unpauses the simulation during an action, 2 advances by physics steps.
        num_gazebo_steps: Number of physics steps per step in mode 2.

    Attributes:
        info: Last return value of ``step`` and ``reset``; hooks write into it: ``is_success``.
        reset_options: The ``options`` of the last ``reset``.

    Raises:
        ConfigurationError: An argument is invalid, arguments contradict each other, or the backend does not support
            one.
        RosError: Something did not start or rejected a request; the message contains details.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it
    _open: ClassVar[weakref.WeakSet[RobotBasicEnv]] = weakref.WeakSet()

    _is_constructing = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "__init__" in vars(cls):
            cls.__init__ = _whole(cls.__init__)  # type: ignore[method-assign]

    @_whole
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        settings = RobotSettings(*args, **kwargs)
        settings.check()
        use_ros()
        self.info: dict[str, Any] = {}
        self.reset_options: dict[str, Any] = {}
        self._settings = settings
        self._closed = False
        self._processes: list[processes.Process] = []
        if "launch_Gazebo" in refused and not (settings.launch_gazebo or processes.owned(["gazebo"])):
            raise refused.pop("launch_Gazebo")  # the script continued without the requested world
        self._start()

    def _start(self) -> None:
        settings = self._settings
        if settings.launch_gazebo:
            or_raise(launch.launch_Gazebo)(**settings.launch())
        if settings.gazebo_max_freq is not None:
            or_raise(physics.gazebo_set_max_update_rate)(settings.gazebo_max_freq)
        if settings.gazebo_timestep is not None:
            or_raise(physics.gazebo_set_time_step)(settings.gazebo_timestep)
        if settings.spawn_robot:
            or_raise(spawn_model_in_gazebo)(**settings.robot())
        if settings.reset_controllers:
            with _unpaused():
                self._reset_controllers()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Send an action, then get the observation, the reward and the end of the episode.

        Returns:
            Observation, reward, terminated, False, info.

        Raises:
            ResetNeededError: The environment is closed.
            RosError: The simulation or the ROS master has ended.
            KeyboardInterrupt: A signal, such as that of Ctrl-C, has shut this process's node down.
        """
        self._require_open("step")
        with interruptible():
            return self._step(action)

    def _step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.info = {}
        if self._settings.step_mode == 1:
            with _unpaused():
                self._send_action(action)
        else:
            self._send_action(action)
            or_raise(world.gazebo_step_physics)(self._settings.num_gazebo_steps)
        observation = self._get_observation()
        reward = self._get_reward()
        terminated = bool(self._check_if_done())
        return observation, reward, terminated, False, self.info

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Seed of ``np_random``, which hooks draw from; None: it is not reseeded.
            options: Stored in ``reset_options`` for the hooks.

        Returns:
            Observation and info.

        Raises:
            ResetNeededError: The environment is closed.
            MasterError: No ROS master answers.
            RosError: The simulation has ended.
            KeyboardInterrupt: A signal, such as that of Ctrl-C, has shut this process's node down.
        """
        self._require_open("reset")
        super().reset(seed=seed)
        with interruptible():
            master.require()
            _ensure_node()
            self.info = {}
            self.reset_options = dict(options or {})
            self._reset_gazebo()
            return self._get_observation(), self.info

    def _reset_gazebo(self) -> None:
        """Reset the simulation, prepare the episode while it runs, and pause it."""
        or_raise(world.gazebo_pause_physics)()
        reset = world.gazebo_reset_world if self._settings.reset_mode == 1 else world.gazebo_reset_sim
        or_raise(reset)()
        with _unpaused():
            if self._settings.reset_controllers:
                self._reset_controllers()  # a controller manager switches in its update, so not while paused
            self._check_subs_and_pubs_connection()
            self._set_episode_init_params()

    def close(self) -> None:
        """End only the processes that this environment has started. Calling it again has no effect."""
        if getattr(self, "_closed", True):
            return
        self._closed = True
        self._open.discard(self)
        others = len(self._open)
        ours = [
            p for p in self._processes if not (others and p.kind == "master")
        ]  # several environments may share a master
        if not processes.stop(ours):
            LOG.warning(
                "not all processes of the environment could be ended: %s", [p.name for p in ours if p.is_running]
            )
        super().close()

    def _reset_controllers(self) -> None:
        or_raise(reset_controllers_srv)(list(self._settings.controller_list or ()), ns=join(self._settings.namespace))

    def _require_open(self, what: str) -> None:
        if self._closed:
            raise ResetNeededError(f"{what} was called on a closed environment; create a new one.")

    def _send_action(self, action: Any) -> None:
        """Send an action to the robot; implemented by subclasses."""
        raise NotImplementedError(f"{type(self).__name__} must implement _send_action, which sends an action")

    def _get_observation(self) -> Any:
        """Return an observation of the observation space; implemented by subclasses."""
        raise NotImplementedError(
            f"{type(self).__name__} must implement _get_observation, which returns the observation"
        )

    def _get_reward(self) -> float:
        """Return the reward of the step; implemented by subclasses."""
        raise NotImplementedError(f"{type(self).__name__} must implement _get_reward, which returns the reward")

    def _check_if_done(self) -> bool:
        """Return whether the episode has ended; implemented by subclasses.

        On success, set ``self.info["is_success"] = 1.0``.
        """
        raise NotImplementedError(
            f"{type(self).__name__} must implement _check_if_done, which returns whether the episode has ended"
        )

    def _check_subs_and_pubs_connection(self) -> bool:
        """Wait until topics and services exist; implemented by subclasses."""
        raise NotImplementedError(
            f"{type(self).__name__} must implement _check_subs_and_pubs_connection, which waits for topics and "
            "services; return True if it needs none"
        )

    def _set_episode_init_params(self) -> None:
        """Prepare an episode, drawing poses and goals from ``np_random``; implemented by subclasses."""
        raise NotImplementedError(
            f"{type(self).__name__} must implement _set_episode_init_params, which prepares an episode"
        )


RobotBasicEnv.__init__.__signature__ = inspect.signature(RobotSettings.__init__)  # type: ignore[attr-defined]


@contextlib.contextmanager
def _unpaused() -> Iterator[None]:
    """Unpause the simulation inside this context."""
    or_raise(world.gazebo_unpause_physics)()
    try:
        yield
    finally:
        or_raise(world.gazebo_pause_physics)()


def _ensure_node() -> None:
    """Initialize a node in this process, unless the script has done so."""
    import rospy

    if not rospy.core.is_initialized():
        rospy.init_node("frobs_env", anonymous=True, disable_signals=True)
