"""RLlib environment runner for a vector environment with same-step autoreset."""

from __future__ import annotations

import secrets
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import ray
import torch as th
from ray.rllib.core import DEFAULT_MODULE_ID
from ray.rllib.core.columns import Columns
from ray.rllib.env import INPUT_ENV_SINGLE_SPACES, INPUT_ENV_SPACES
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner
from ray.rllib.env.single_agent_episode import SingleAgentEpisode

from frobs_ray.errors import EnvironmentCopyError
from frobs_ray.rllib.fragments import Array, Step, fragments
from frobs_ray.rllib.spaces import FlatSpaces
from frobs_train import EnvironmentRecipe, EpisodeRecorder, FinishedEpisodes

EPISODES = "frobs_episodes"
"""Key of the metric that contains the finished episodes."""


class VectorEnvRunner(SingleAgentEnvRunner):
    """Environment runner that steps many environments at once and returns fragments of their episodes.

    All environments of a runner form one batch, so the policy is evaluated once per step. RLlib's own runner stores
    its environments in a list and expects next-step autoreset.

    The ``env_config`` in RLlib's configuration has these keys:

    - ``recipe``: the :class:`~frobs_train.environments.EnvironmentRecipe` of the environments,
    - ``spaces``: the :class:`FlatSpaces` of the environments,
    - ``seed``: the seed from which each runner derives its own seeds,
    - ``random_steps``: the number of initial steps with random actions in each environment.

    Attributes:
        given: Environment that a new runner in this process uses, or None if the runner creates its own environment.
            RLlib's configuration cannot contain the environment, because RLlib copies the configuration and sends it
            to other processes.
        problem: Message about an error in this runner's environment, or an empty string if no error has occurred.
    """

    given: ClassVar[gym.vector.VectorEnv[Any, Any, Any] | None] = None
    problem: str = ""
    _own: bool = False  # whether this runner created its environment

    def make_env(self) -> None:
        """Create this runner's environment and random number generators."""
        config = self.config.env_config
        self._spaces: FlatSpaces = config["spaces"]
        self._random_steps: int = config["random_steps"]
        seeds = [config["seed"], self.worker_index or 0]
        self._finished: list[FinishedEpisodes] = []
        self._own = self.given is None
        self.env: Any = self._make() if self._own else self.given
        if self._own and ray.get_runtime_context().was_current_actor_reconstructed:
            seeds.append(secrets.randbits(31))  # with the old seeds, a restarted runner would repeat its episodes
        sequence = np.random.SeedSequence(seeds)
        env_seed, action_seed, random_seed = (int(number) for number in sequence.generate_state(3) >> 1)
        self._env_seed = env_seed if self._own else None
        self._generator = th.Generator().manual_seed(action_seed)
        self._random = np.random.default_rng(random_seed)
        self.num_envs = self.config.num_envs_per_env_runner
        self._needs_initial_reset = True

    def _make(self) -> EpisodeRecorder | None:
        """Return a new environment, or store the reason for a failure in :attr:`problem` and return None."""
        th.set_num_threads(1)
        recipe: EnvironmentRecipe = self.config.env_config["recipe"]
        try:
            env = recipe.make(self.config.num_envs_per_env_runner, int(self.config.num_cpus_per_env_runner))
        except Exception as error:  # keep the error for later; if it were raised, RLlib would only restart the runner
            self.problem = f"{type(error).__name__}: {error}"
            return None
        return EpisodeRecorder(env, self._finished.append)

    def get_spaces(self) -> dict[str, Any]:
        """Return the spaces of the networks as a dictionary with RLlib's keys."""
        spaces: FlatSpaces = self.config.env_config["spaces"]  # RLlib may ask before it calls make_env
        pair = (spaces.observation, spaces.action)
        return dict.fromkeys((INPUT_ENV_SPACES, INPUT_ENV_SINGLE_SPACES, DEFAULT_MODULE_ID), pair)

    def sample(  # type: ignore[override]  # same arguments as in RLlib's own runner
        self,
        *,
        num_timesteps: int | None = None,
        num_episodes: int | None = None,
        explore: bool | None = None,
        random_actions: bool = False,
        force_reset: bool = False,
    ) -> list[SingleAgentEpisode]:
        """Step the environments with actions sampled from the policy."""
        assert num_episodes is None
        if num_timesteps is None:
            steps = int(self.config.get_rollout_fragment_length(self.worker_index))
        else:
            steps = -(-num_timesteps // self.num_envs)
        try:
            if self._needs_initial_reset or force_reset:
                seed = self._env_seed if self._needs_initial_reset else None
                self._observation = self._spaces.flatten(self.env.reset(seed=seed)[0])
                self._needs_initial_reset = False
            first = self._observation
            with th.no_grad():
                taken = [self._step(random_actions or self._random_steps > 0) for _ in range(steps)]
        except Exception as error:
            self.problem = self.problem or f"{type(error).__name__}: {error}"
            raise
        episodes = fragments(first, taken)
        untyped: Any = self
        untyped._increase_sampled_metrics(steps * self.num_envs, sum(episode.is_done for episode in episodes))
        return episodes

    def get_metrics(self) -> Any:
        """Return the number of steps and the finished episodes since the last call."""
        for finished in self._finished:
            self.metrics.log_value(EPISODES, finished, reduce="item_series")
        self._finished.clear()
        return self.metrics.reduce()

    def stop(self) -> None:
        """Close the environment if this runner created it."""
        if self._own and self.env is not None:
            self.env.close()

    def _step(self, random_actions: bool) -> Step:
        if random_actions:
            self._random_steps -= 1
            outputs: dict[str, Array] = {Columns.ACTIONS: self._draw_uniformly()}
        else:
            module: Any = self.module
            tensors = module.act(th.from_numpy(self._observation), self._generator)
            outputs = {name: tensor.numpy() for name, tensor in tensors.items()}
        observation, reward, terminated, truncated, info = self.env.step(self._spaces.to_env(outputs[Columns.ACTIONS]))
        ended = np.flatnonzero(terminated | truncated).tolist()
        finals = {env: self._spaces.flatten_one(info["final_obs"][env]) for env in ended}
        diverged = info["final_info"].get("frobs/diverged") if ended else None
        if diverged is not None:  # the physics diverged: do not bootstrap the final value
            terminated = terminated | diverged
        self._observation = self._spaces.flatten(observation)
        return Step(outputs, self._observation, reward.copy(), terminated.copy(), truncated.copy(), finals)

    def _draw_uniformly(self) -> Array:
        space = self._spaces.action
        if isinstance(space, gym.spaces.Discrete):
            return self._random.integers(space.n, size=self.num_envs)
        return self._random.uniform(-1.0, 1.0, (self.num_envs, *(space.shape or ()))).astype(np.float32)


def recipe_of(env: gym.vector.VectorEnv[Any, Any, Any]) -> EnvironmentRecipe:
    """Return the recipe for the environments of a training run.

    Raises:
        EnvironmentCopyError: A wrapper or a callback cannot be recreated, or no training run made the environment.
    """
    recipe = getattr(env, "recipe", None)
    if not isinstance(recipe, EnvironmentRecipe):
        raise EnvironmentCopyError("no training run made the environment", "use frobs_train.train")
    for component in recipe.wrappers:
        if component.adapts:
            raise EnvironmentCopyError(
                f"the wrapper {component.name} uses statistics that are collected in a single process",
                "replace this wrapper with a wrapper that uses fixed constants",
            )
    if recipe.obstacle:
        raise EnvironmentCopyError(recipe.obstacle, "remove this setting")
    return recipe
