"""FRobs_RL's ``RobotBasicEnv``: a robot in Gazebo, or behind its names, as a Gymnasium environment.

It stands beside the five kinds, for those who port. Six hooks are the user's to write.
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
    """Let the outermost constructor of an environment fail as a whole: an error ends all that it has started."""

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
    """The base of environments whose robot lives in a ROS graph.

    The constructor launches the simulation, sets its speed and time step, spawns the robot and resets its controllers,
    in this order and as far as its arguments ask for it. What it starts, :meth:`close` ends, and nothing else; an error
    ends it at once. Spaces are the subclass's to set. If a model cannot be spawned, or a node, launch file or controller
    cannot be started, while the constructor of a subclass runs, the constructor fails with the reason.

    A step of mode 1 lets the time run while :meth:`_send_action` does what it does, so its simulated duration is that
    of the call, times the real-time factor; one of mode 2 is ``num_gazebo_steps`` physics steps, always.

    Args:
        launch_gazebo: Whether to launch the simulation; see :func:`frobs_ros.ros_gazebo.launch_Gazebo`.
        gazebo_init_paused: Whether it begins with the time standing still.
        gazebo_use_gui: Whether it has a window.
        gazebo_recording: Whether it records its state.
        gazebo_freq: Of /clock [Hz].
        world_path: A world file.
        world_pkg: A ROS package with a world file; used where no path is given.
        world_filename: The world file in the package.
        gazebo_max_freq: Real-time factor that the simulation may run at: 1 is real time, 10 ten times as fast.
        gazebo_timestep: Of the physics [s].
        spawn_robot: Whether to spawn the robot; see :func:`frobs_ros.ros_spawn.spawn_model_in_gazebo`.
        model_name_in_gazebo: Its name in the simulation.
        namespace: Of its topics and services.
        pkg_name: The ROS package that holds its files.
        urdf_file: Its URDF or xacro.
        urdf_folder: The folder of it in the package.
        controller_file: YAML file of its controllers in the package's folder ``config``.
        controller_list: Its controllers.
        urdf_xacro_args: Arguments of the xacro: ``["effort:=true"]``.
        rob_state_publisher_max_freq: Highest rate of the state publisher [Hz].
        rob_st_term: Whether to run the state publisher in an xterm.
        model_pos_x: [m]
        model_pos_y: [m]
        model_pos_z: [m]
        model_ori_x: Of a quaternion of length 1; four zeros, the default, are no rotation.
        model_ori_y: Of the quaternion.
        model_ori_z: Of the quaternion.
        model_ori_w: Scalar of the quaternion.
        reset_controllers: Whether each reset stops the controllers and starts them again.
        reset_mode: 1 puts models back, 2 the clock as well.
        step_mode: 1 lets the time run during an action, 2 advances by physics steps.
        num_gazebo_steps: Physics steps of a step of mode 2.

    Attributes:
        info: What ``step`` and ``reset`` return as their last value; hooks write into it: ``is_success``.
        reset_options: What ``reset`` was given as ``options``.

    Raises:
        ConfigurationError: An argument is none, or two contradict each other, or the backend cannot do it.
        RosError: Something did not start or refused; the message says what.
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
            raise refused.pop("launch_Gazebo")  # the script went on without the world that it asked for
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
        """Send an action; observe, then reward, then see whether the episode is done.

        Returns:
            Observation, reward, terminated, False, info.

        Raises:
            ResetNeededError: The environment is closed.
            RosError: The simulation, or the ROS master, is gone.
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
            seed: Of ``np_random``, which hooks draw from; None: it goes on.
            options: Kept in ``reset_options`` for the hooks.

        Returns:
            Observation and info.

        Raises:
            ResetNeededError: The environment is closed.
            MasterError: No ROS master answers.
            RosError: The simulation is gone.
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
        """Put the simulation back, and prepare the episode while its time runs; it stands still afterwards."""
        or_raise(world.gazebo_pause_physics)()
        reset = world.gazebo_reset_world if self._settings.reset_mode == 1 else world.gazebo_reset_sim
        or_raise(reset)()
        with _unpaused():
            if self._settings.reset_controllers:
                self._reset_controllers()  # a controller manager switches in its update, so not while paused
            self._check_subs_and_pubs_connection()
            self._set_episode_init_params()

    def close(self) -> None:
        """End what this environment has started, and nothing else; twice is harmless."""
        if getattr(self, "_closed", True):
            return
        self._closed = True
        self._open.discard(self)
        others = len(self._open)
        ours = [p for p in self._processes if not (others and p.kind == "master")]  # one master may serve several
        if not processes.stop(ours):
            LOG.warning(
                "not all processes of the environment could be ended: %s", [p.name for p in ours if p.is_running]
            )
        super().close()

    def _reset_controllers(self) -> None:
        or_raise(reset_controllers_srv)(list(self._settings.controller_list or ()), ns=join(self._settings.namespace))

    def _require_open(self, what: str) -> None:
        if self._closed:
            raise ResetNeededError(f"{what} was called on an environment that is closed; make a new one.")

    def _send_action(self, action: Any) -> None:
        """Send an action to the robot; yours to write."""
        raise NotImplementedError(f"{type(self).__name__} does not say how an action is sent: write _send_action")

    def _get_observation(self) -> Any:
        """Return an observation of the observation space; yours to write."""
        raise NotImplementedError(f"{type(self).__name__} does not say what is observed: write _get_observation")

    def _get_reward(self) -> float:
        """Return the reward of the step; yours to write."""
        raise NotImplementedError(f"{type(self).__name__} does not say what is rewarded: write _get_reward")

    def _check_if_done(self) -> bool:
        """Return whether the episode has ended; ``self.info["is_success"] = 1.0`` says by success. Yours to write."""
        raise NotImplementedError(f"{type(self).__name__} does not say when it is done: write _check_if_done")

    def _check_subs_and_pubs_connection(self) -> bool:
        """Wait until topics and services are there; yours to write where something is to be waited for."""
        raise NotImplementedError(
            f"{type(self).__name__} does not say what it waits for: write _check_subs_and_pubs_connection, and return "
            "True where there is nothing"
        )

    def _set_episode_init_params(self) -> None:
        """Prepare an episode: the robot's pose, obstacles, a goal; yours to write, drawing from ``np_random``."""
        raise NotImplementedError(
            f"{type(self).__name__} does not say how an episode begins: write _set_episode_init_params"
        )


RobotBasicEnv.__init__.__signature__ = inspect.signature(RobotSettings.__init__)  # type: ignore[attr-defined]


@contextlib.contextmanager
def _unpaused() -> Iterator[None]:
    """Let the simulated time run inside."""
    or_raise(world.gazebo_unpause_physics)()
    try:
        yield
    finally:
        or_raise(world.gazebo_pause_physics)()


def _ensure_node() -> None:
    """Make this process a node where its script has not."""
    import rospy

    if not rospy.core.is_initialized():
        rospy.init_node("frobs_env", anonymous=True, disable_signals=True)
