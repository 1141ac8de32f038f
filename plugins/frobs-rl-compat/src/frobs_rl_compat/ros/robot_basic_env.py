"""Implements FRobs_RL's ``RobotBasicEnv``, a Gymnasium environment for a robot in Gazebo or in the bridge.

``RobotBasicEnv`` is intended for porting FRobs_RL environments. The class does not use FRobs's simulators, robots,
controllers, tasks or algorithms. Subclasses implement six hook methods.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import weakref
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import gymnasium as gym

from frobs_core.util.errors import EnvironmentCopyError, ResetNeededError
from frobs_rl_compat.gazebo import launch, physics, world
from frobs_rl_compat.ros.arguments import describe_arguments
from frobs_rl_compat.ros.logged_errors import constructing, or_raise, refused
from frobs_rl_compat.ros.robot_settings import RobotSettings
from frobs_rl_compat.ros.ros_controllers import reset_controllers_srv
from frobs_rl_compat.ros.ros_spawn import spawn_model_in_gazebo
from frobs_ros.ros import LOG, master, processes
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.interrupts import interruptible
from frobs_ros.ros.names import join


def _whole(init: Callable[..., None]) -> Callable[..., None]:
    """Wrap a constructor so that an error ends all processes that the outermost constructor has started."""

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
    """Base class for environments whose robot is controlled through ROS.

    Depending on its arguments, the constructor launches the simulation, sets the simulation's speed and time step,
    spawns the robot, and resets the robot's controllers, in this order. If the constructor raises an error, it ends all
    processes that it has started. :meth:`close` ends only processes that the constructor has started. Subclasses must
    set the observation space and the action space.

    If a subclass's constructor calls a function that fails to spawn a model, or to start a node, launch file or
    controller, the constructor raises the function's error.

    In step mode 1, the simulation runs only while :meth:`_send_action` runs, so the simulated duration of a step is the
    duration of this call multiplied by the real-time factor. In step mode 2, a step always takes ``num_gazebo_steps``
    physics steps.

    Attributes:
        info: The ``info`` dictionary of the current step or reset. Hooks may add entries, such as ``is_success``.
        reset_options: The ``options`` that were passed to the last ``reset``.

    Raises:
        ConfigurationError: An argument is invalid, conflicts with another argument, or is not supported by the backend.
        RosError: A ROS program did not start or rejected a request. The error message contains details.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - same declaration as in Gymnasium
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
            raise refused.pop("launch_Gazebo")  # the launch failed, but the script ignored the failure
        self._start()

    def __reduce__(self) -> tuple[Any, ...]:
        """Reject copying and pickling."""
        raise EnvironmentCopyError("it commands a robot through ROS, and a copy would command the same robot")

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
        """Send an action, and return the resulting observation and reward.

        Returns:
            The observation, the reward, whether the episode has terminated, False for truncation, and the ``info``
            dictionary.

        Raises:
            ResetNeededError: The environment is closed.
            RosError: The simulation or the ROS master has ended.
            KeyboardInterrupt: A signal, such as SIGINT from Ctrl-C, has shut down this process's node.
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
        """Start a new episode.

        Args:
            seed: Seed for ``np_random``, which hooks use for random numbers. By default, ``np_random`` is not reseeded.
            options: Options that are stored in ``reset_options`` for the hooks.

        Returns:
            The observation and the ``info`` dictionary.

        Raises:
            ResetNeededError: The environment is closed.
            MasterError: No ROS master responds.
            RosError: The simulation has ended.
            KeyboardInterrupt: A signal, such as SIGINT from Ctrl-C, has shut down this process's node.
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
        """Reset the simulation, prepare the episode while the simulation runs, and pause the simulation."""
        or_raise(world.gazebo_pause_physics)()
        reset = world.gazebo_reset_world if self._settings.reset_mode == 1 else world.gazebo_reset_sim
        or_raise(reset)()
        with _unpaused():
            if self._settings.reset_controllers:
                self._reset_controllers()  # controllers cannot be switched while the simulation is paused
            self._check_subs_and_pubs_connection()
            self._set_episode_init_params()

    def close(self) -> None:
        """End the processes that this environment has started, and no others. Further calls have no effect."""
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
                "some processes of the environment could not be stopped: %s", [p.name for p in ours if p.is_running]
            )
        super().close()

    def _reset_controllers(self) -> None:
        or_raise(reset_controllers_srv)(list(self._settings.controller_list or ()), ns=join(self._settings.namespace))

    def _require_open(self, what: str) -> None:
        if self._closed:
            raise ResetNeededError(f"{what} was called on a closed environment; create a new one.")

    def _unimplemented(self, what: str) -> NotImplementedError:
        return NotImplementedError(f"{type(self).__name__} must implement {what}")

    def _send_action(self, action: Any) -> None:
        """Send an action to the robot. Subclasses must implement this method."""
        raise self._unimplemented("_send_action, which sends an action")

    def _get_observation(self) -> Any:
        """Return an observation from the observation space. Subclasses must implement this method."""
        raise self._unimplemented("_get_observation, which returns the observation")

    def _get_reward(self) -> float:
        """Return the reward for the current step. Subclasses must implement this method."""
        raise self._unimplemented("_get_reward, which returns the reward")

    def _check_if_done(self) -> bool:
        """Return whether the episode has ended. Subclasses must implement this method.

        If the task has succeeded, implementations should set ``self.info["is_success"] = 1.0``.
        """
        raise self._unimplemented("_check_if_done, which returns whether the episode has ended")

    def _check_subs_and_pubs_connection(self) -> bool:
        """Wait until the required topics and services exist. Subclasses must implement this method."""
        raise self._unimplemented(
            "_check_subs_and_pubs_connection, which waits for topics and services and returns True when all of them exist"
        )

    def _set_episode_init_params(self) -> None:
        """Prepare an episode, using ``np_random`` for random poses and goals. Subclasses must implement this method."""
        raise self._unimplemented("_set_episode_init_params, which prepares the next episode")


RobotBasicEnv.__init__.__signature__ = inspect.signature(RobotSettings.__init__)  # type: ignore[attr-defined]
RobotBasicEnv.__doc__ = describe_arguments(RobotBasicEnv)


@contextlib.contextmanager
def _unpaused() -> Iterator[None]:
    or_raise(world.gazebo_unpause_physics)()
    try:
        yield
    finally:
        or_raise(world.gazebo_pause_physics)()


def _ensure_node() -> None:
    """Initialize a ROS node in this process, unless the script has already initialized one."""
    import rospy

    if not rospy.core.is_initialized():
        rospy.init_node("frobs_env", anonymous=True, disable_signals=True)
