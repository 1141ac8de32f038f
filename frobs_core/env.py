"""The single environment: a robot, its controller and a task on a simulator, behind Gymnasium's interface."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Action
from frobs_core.compose import compose
from frobs_core.errors import ResetNeededError
from frobs_core.interfaces import GoalTask, Robot, Snapshot
from frobs_core.interfaces.task import Observation
from frobs_core.loop import RENDER_MODES, Loop, check_render_mode
from frobs_core.specs import ControllerRecord, SimulatorRecord, TaskRecord


class RobotEnv(gym.Env[Any, Any]):
    """One robot with one task.

    ``info`` holds ``is_success`` (0.0 or 1.0) and ``frobs/reward/<term>`` in every step, what the controller tells
    (``frobs/…``), and ``frobs/diverged`` when the engine gave the state up; the episode is then truncated.

    Args:
        task: Name of the task, or a record that is not installed yet.
        robot: Name of the robot, path of a URDF, xacro or MJCF file, or a description.
        controller: Name of the controller, or a record.
        simulator: Name of the simulator, or a record.
        reward_type: One of the task's; None: its first.
        render_mode: ``"rgb_array"``, ``"human"`` or None.
        camera: Of the pictures; None: the scene's first.
        render_size: (height, width) of the pictures [pixels].
        control_timestep: Between two actions [s]; None: the controller's own, if it has one, or the task's.
        physics_timestep: Of one engine step [s]; None: the task's own.
        controller_kwargs: Keywords of the controller.
        robot_args: Arguments of the robot's xacro file.
        package_paths: Folders of the ROS packages that the robot's file names, by package name.
        home: Rest configuration by joint name [rad or m]; what is left out is the robot's own.
        tcp: Link that the task talks about; None: the robot's own.
        sensors: What is other about the robot's sensors, by name: ``{"lidar": {"rays": 36, "noise": 0.01}}``; see
            :mod:`frobs_core.sensors`.
        num_threads: For the engine; 0: one for each processor.
        randomize: What differs between environments and episodes; see :mod:`frobs_core.randomization`.
        task_parameters: Keywords of the task.

    Attributes:
        randomization: What is randomised, with the values in force; None: nothing.

    Raises:
        UnknownNameError: No plugin offers one of the names.
        UnknownParameterError: The task or the controller does not take a keyword.
        CapabilityError: The simulator lacks what the task, the controller or the randomisation needs.
        ConfigurationError: A value cannot be used.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        *,
        task: str | TaskRecord,
        robot: str | Robot,
        controller: str | ControllerRecord,
        simulator: str | SimulatorRecord = "mujoco",
        reward_type: str | None = None,
        render_mode: str | None = None,
        camera: str | None = None,
        render_size: tuple[int, int] = (480, 640),
        control_timestep: float | None = None,
        physics_timestep: float | None = None,
        controller_kwargs: Mapping[str, Any] | None = None,
        robot_args: Mapping[str, str] | None = None,
        package_paths: Mapping[str, str] | None = None,
        home: Mapping[str, float] | None = None,
        tcp: str | None = None,
        sensors: Mapping[str, Any] | None = None,
        num_threads: int = 0,
        randomize: Mapping[str, Any] | None = None,
        **task_parameters: Any,
    ) -> None:
        check_render_mode(render_mode)
        parts = compose(
            num_envs=1,
            task=task,
            robot=robot,
            controller=controller,
            simulator=simulator,
            reward_type=reward_type,
            control_timestep=control_timestep,
            physics_timestep=physics_timestep,
            controller_kwargs=controller_kwargs or {},
            robot_args=robot_args or {},
            package_paths=package_paths or {},
            home=home or {},
            tcp=tcp,
            sensors=sensors,
            num_threads=num_threads,
            randomize=randomize,
            task_parameters=task_parameters,
        )
        self._loop = Loop(parts, 1)
        self.simulation, self.robot = parts.simulation, parts.robot
        self.controller, self.task = parts.controller, parts.task
        self.randomization = parts.randomization
        self.control_timestep, self.decimation = parts.control_timestep, parts.decimation
        self.action_space = parts.controller.action_space
        self.observation_space = parts.task.observation_space
        self.render_mode, self._camera, self._render_size = render_mode, camera, render_size
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": round(1.0 / parts.control_timestep)}
        self._seeded = False
        self._running = False
        self._action_shape = self.action_space.shape
        if isinstance(parts.task, GoalTask):
            self.compute_reward = parts.task.compute_reward  # where hindsight replay looks for it

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: All that the environment draws from now on depends on it; None: the next episode of the last seed.
            options: Those of the task's ``reset_options``: ``{"goal": (3,), "joint_positions": (dof,)}``.

        Returns:
            observation, info

        Raises:
            UnknownParameterError: The task understands no such option.
            ConfigurationError: An option cannot be used.
        """
        spread = self._loop.options(options)
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self._loop.rng.seed([self.np_random_seed])
            self._seeded = True
        observation = self._loop.begin(None, spread)
        self._running = True
        if self.render_mode == "human":
            self.simulation.open_viewer()
        return _row(observation), self._told()

    def _told(self) -> dict[str, Any]:
        """Return what the info of a reset tells."""
        if self.randomization is None:
            return {}
        return {"frobs/randomization": {name: values[0] for name, values in self.randomization.values.items()}}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control step.

        Args:
            action: In the action space; a Box's is clipped to it.

        Returns:
            observation, reward, terminated, truncated, info

        Raises:
            InvalidActionError: The action has the wrong shape or is not finite.
            ResetNeededError: No episode is running.
        """
        if not self._running:
            raise ResetNeededError("no episode is running; call reset() first.")
        loop, task = self._loop, self.task
        checked = self._check(action)  # first of all: a step that is refused is none, not even for the random numbers
        loop.rng.begin_step()
        command = self.controller.apply(checked)
        if self.randomization is not None:
            command = self.randomization.act(loop.rng, command)
        self.robot.command(command)
        self.simulation.step(self.decimation)
        task.advance(loop.rng)
        observation = task.observe(loop.rng)
        if self.randomization is not None:
            observation = self.randomization.observe(loop.rng, observation)
        reward: float = task.reward().item()
        ends = task.is_terminated()
        terminated = ends is not None and ends.item()
        info: dict[str, Any] = {"is_success": float(task.is_success().item())}
        for term, values in task.reward_terms().items():
            info[loop.key(term)] = values.item()
        if loop.controller_tells:
            info |= {f"frobs/{name}": values.item() for name, values in self.controller.info().items()}
        diverged = self.simulation.diverged is not None
        if diverged:
            info["frobs/diverged"] = True
            reward = 0.0
        if terminated or diverged:
            self._running = False
        return _row(observation), reward, terminated, diverged, info

    def _check(self, action: Any) -> Action:
        if self._loop.discrete:
            if not self.action_space.contains(action):
                self._loop.fail_action(action, self.action_space)
            return np.asarray(action, np.int64)[None]
        array = np.asarray(action, np.float64)
        if array.shape != self._action_shape or not array.dot(array) < math.inf:  # one number tells of all
            self._loop.fail_action(action, self.action_space)
        return array[None]

    def render(self) -> Any:
        """Return a picture, (height, width, 3) uint8, if ``render_mode`` is ``"rgb_array"``."""
        if self.render_mode != "rgb_array":
            return None
        return self._loop.render(None, self._camera, self._render_size)[0]

    def snapshot(self) -> Snapshot:
        """Return the complete state of the environment (not of the wrappers around it)."""
        return {**self._loop.snapshot(), "running": np.array([self._running])}

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot."""
        self._loop.restore(snapshot)
        self._running, self._seeded = bool(snapshot["running"][0]), True

    def close(self) -> None:
        """Release the simulation; twice is harmless."""
        self._running = False
        self.simulation.close()


def _row(observation: Observation) -> Any:
    """Return the only row of a batched observation."""
    if isinstance(observation, dict):
        return {key: values[0] for key, values in observation.items()}
    return observation[0]
