"""Settings, action noise and replay buffer shared by the off-policy algorithms."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import gymnasium as gym
from gymnasium import spaces
from pydantic import Field, NonNegativeInt, PositiveInt, model_validator
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.buffers import DictReplayBuffer, NStepReplayBuffer, ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from frobs_algos import demonstrations
from frobs_algos.settings import Fraction, Settings
from frobs_algos_sb3 import replay
from frobs_algos_sb3.algorithm import SB3Algorithm
from frobs_algos_sb3.config import SampleFrequency, SB3Config
from frobs_algos_sb3.networks import DeterministicConfig
from frobs_algos_sb3.noise import ActionNoiseConfig
from frobs_core.util.errors import ConflictingOptionsError, IncompatibleSpaceError, ParameterValueError

_DEMONSTRATIONS = "demonstrations"
"""Name of the demonstrations' folder in a checkpoint."""

GOAL_KEYS = frozenset({"observation", "achieved_goal", "desired_goal"})


class TrainFrequency(Settings):
    """Amount of data that is collected between two training rounds.

    Attributes:
        frequency: Number of steps or episodes.
        unit: ``step`` for steps of every environment, or ``episode`` for episodes, which requires a single environment.
    """

    frequency: PositiveInt = 1
    unit: Literal["step", "episode"] = "step"


class ReplayBufferConfig(Settings):
    """Settings of the replay buffer.

    Attributes:
        type: ``standard``, or ``her`` for hindsight replay in goal-conditioned environments. If None, hindsight replay
            is used if the environment can compute the rewards for other goals.
        handle_timeout_termination: Whether to bootstrap the final value of episodes that end because of a time limit.
        n_sampled_goal: In hindsight replay, the number of steps with a substituted goal per step with the original
            goal.
        goal_selection_strategy: Goals that hindsight replay substitutes: later goals (``future``), the last goal
            (``final``) or any goal (``episode``) of the same episode.
    """

    type: Literal["standard", "her"] | None = None
    handle_timeout_termination: bool = True
    n_sampled_goal: PositiveInt = 4
    goal_selection_strategy: Literal["future", "final", "episode"] = "future"


class OffPolicyConfig(SB3Config):
    """Settings that every off-policy algorithm accepts.

    Attributes:
        buffer_size: Capacity of the replay buffer, in steps over all environments.
        learning_starts: Number of steps with random actions before learning starts, over all environments. With
            hindsight replay, learning never starts before the first episodes have ended.
        batch_size: Number of samples per gradient step.
        train_freq: Number of steps of every environment between two training rounds, or ``{frequency, unit}``.
        gradient_steps: Number of gradient steps per training round, or −1 for one gradient step per collected step,
            over all environments.
        n_steps: Number of rewards that are summed before the value of the following state is added.
        optimize_memory_usage: Whether to store each observation only once, which requires ``handle_timeout_termination:
            false``.
        replay_buffer: Settings of the replay buffer.
        demonstrations: Folder of a data set, or name or path of a policy, such as ``expert``, that plays episodes before
            training starts, or None. Half of each batch is then drawn from these steps.
        demonstration_episodes: Number of episodes that the policy plays. A data set is used as a whole.
        demonstration_mapping: YAML file that maps observation terms to the columns of a data set that FRobs did not
            record, or None.
    """

    buffer_size: PositiveInt = 1_000_000
    learning_starts: NonNegativeInt = 100
    batch_size: PositiveInt = 256
    train_freq: PositiveInt | TrainFrequency = 1
    gradient_steps: Annotated[int, Field(ge=-1)] = 1
    n_steps: PositiveInt = 1
    optimize_memory_usage: bool = False
    replay_buffer: ReplayBufferConfig = ReplayBufferConfig()
    demonstrations: str | None = None
    demonstration_episodes: PositiveInt = 50
    demonstration_mapping: str | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.demonstrations is not None and self.batch_size < 2:
            raise ValueError("demonstrations require a batch_size of at least 2")
        if self.optimize_memory_usage and self.replay_buffer.handle_timeout_termination:
            raise ValueError("optimize_memory_usage requires replay_buffer.handle_timeout_termination: false")
        return self

    def model_kwargs(self) -> dict[str, Any]:
        """Return the keyword arguments of the algorithm's class, except for noise and the replay buffer."""
        kwargs = super().model_kwargs()
        del kwargs["replay_buffer"]
        kwargs.pop("action_noise", None)
        if isinstance(self.train_freq, TrainFrequency):
            kwargs["train_freq"] = (self.train_freq.frequency, self.train_freq.unit)
        return kwargs


class ContinuousConfig(OffPolicyConfig):
    """Settings that the off-policy algorithms with continuous actions accept.

    Attributes:
        tau: Interpolation factor for updates of the target networks, where 1 copies the new weights.
        action_noise: Noise that is added to actions during data collection, or None for no noise.
        policy_kwargs: Settings of the networks.
    """

    tau: Fraction = 0.005
    action_noise: ActionNoiseConfig | None = None
    policy_kwargs: DeterministicConfig = DeterministicConfig()


class ExploringConfig(Settings):
    """Settings of state-dependent exploration (gSDE) of an off-policy algorithm.

    Attributes:
        use_sde: Whether to use gSDE.
        sde_sample_freq: Number of steps after which gSDE draws a new noise matrix, or −1 to draw one only at the start
            of an iteration.
        use_sde_at_warmup: Whether to use gSDE instead of random actions before learning starts.
    """

    use_sde: bool = False
    sde_sample_freq: SampleFrequency = -1
    use_sde_at_warmup: bool = False


class OffPolicy(SB3Algorithm):
    """Base class of off-policy algorithms."""

    _config: OffPolicyConfig
    model: OffPolicyAlgorithm
    _demonstrations: ReplayBuffer | None = None

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, seed)
        source, episodes = self._config.demonstrations, self._config.demonstration_episodes
        if source is None:
            return
        mapping = self._config.demonstration_mapping
        found = self._demonstrate(
            lambda env, seed: demonstrations.load(source, env, episodes, seed, mapping).transitions()
        )
        truncated = found.episode_end & ~found.terminated
        scales = isinstance(self.action_space, spaces.Box)
        rows = {
            "observations": found.observation,
            "next_observations": found.next_observation,
            "actions": self.model.policy.scale_action(found.action) if scales else found.action,
            "rewards": found.reward,
            "dones": found.episode_end,
            "timeouts": truncated & self._config.replay_buffer.handle_timeout_termination,
        }
        replay.fill(self._add_demonstrations(len(found.reward)), rows)

    def save(self, folder: Path, previous: Path | None = None) -> None:
        super().save(folder, previous)
        if self._demonstrations is not None:
            before = None if previous is None else previous / _DEMONSTRATIONS
            replay.write(self._demonstrations, folder / _DEMONSTRATIONS, before)

    def _restore(self, folder: Path, saved: Mapping[str, Any], continuing: bool) -> None:
        super()._restore(folder, saved, continuing)
        if continuing and self._config.demonstrations is not None:
            source = folder / _DEMONSTRATIONS
            replay.read(self._add_demonstrations(replay.row_count(source)), source)

    def _add_demonstrations(self, rows: int) -> ReplayBuffer:
        """Make a buffer for demonstrations, from which half of each batch is drawn, and return the buffer."""
        cls: Any = DictReplayBuffer if isinstance(self.model.observation_space, spaces.Dict) else ReplayBuffer
        kwargs = {}
        if self.model.n_steps > 1:
            cls, kwargs = NStepReplayBuffer, {"n_steps": self.model.n_steps, "gamma": self.model.gamma}
        replayed: Any = self.model.replay_buffer
        buffer: ReplayBuffer = cls(
            rows, self.model.observation_space, self.model.action_space, replayed.device, **kwargs
        )
        replay.mix(replayed, buffer)
        self._demonstrations = buffer
        return buffer

    def _make_model(self, policy: str, **kwargs: Any) -> OffPolicyAlgorithm:
        config = self._config
        self._check_settings()
        self._require_memory("buffer_size", config.buffer_size, 1 if config.optimize_memory_usage else 2)
        noise = getattr(config, "action_noise", None)
        if noise is not None:
            kwargs["action_noise"] = noise.build(self.venv.num_envs, self.action_space.shape[0])  # type: ignore[index]
        buffer = config.replay_buffer
        kwargs["replay_buffer_kwargs"] = {"handle_timeout_termination": buffer.handle_timeout_termination}
        if not self.venv.can_step:  # for prediction only
            kwargs["buffer_size"] = 1
        elif self._uses_hindsight():
            kwargs["replay_buffer_class"] = HerReplayBuffer
            kwargs["replay_buffer_kwargs"] |= {
                "n_sampled_goal": buffer.n_sampled_goal,
                "goal_selection_strategy": buffer.goal_selection_strategy,
            }
            kwargs["learning_starts"] = max(kwargs["learning_starts"], self._first_episodes())
        with warnings.catch_warnings():
            # If there are more environments than steps between target updates, the target is updated at every step.
            warnings.filterwarnings("ignore", "The number of environments used is greater than the target")
            return super()._make_model(policy, **kwargs)  # type: ignore[return-value]

    def _check_settings(self) -> None:
        config, num_envs = self._config, self.venv.num_envs
        owner = f"algorithm '{self.name}'"
        if isinstance(config.train_freq, TrainFrequency) and config.train_freq.unit == "episode" and num_envs > 1:
            raise ConflictingOptionsError(
                ["train_freq.unit: episode", f"num_envs = {num_envs}"],
                f"for {owner}, set num_envs to 1, or train_freq.unit to 'step'",
            )
        if isinstance(self.observation_space, spaces.Dict):
            for name, value in (
                ("n_steps", config.n_steps > 1),
                ("optimize_memory_usage", config.optimize_memory_usage),
            ):
                if value:
                    raise IncompatibleSpaceError(
                        f"{owner}:", self.observation_space, f"{name} is not supported for Dict observations."
                    )

    def _uses_hindsight(self) -> bool:
        chosen = self._config.replay_buffer.type
        space = self.observation_space
        possible = isinstance(space, spaces.Dict) and set(space.spaces) >= GOAL_KEYS and self.venv.computes_reward
        if chosen == "her" and not possible:
            raise IncompatibleSpaceError(
                f"algorithm '{self.name}'",
                self.observation_space,
                "requires a goal-conditioned environment for hindsight replay, which must have the observations "
                f"{', '.join(sorted(GOAL_KEYS))} and a compute_reward method; choose another environment, or set "
                "replay_buffer.type: standard.",
            )
        return possible and chosen != "standard"

    def _first_episodes(self) -> int:
        """Return the number of steps, over all environments, until the first episodes have ended, or 0 if unknown."""
        longest = self.venv.max_episode_steps
        if longest is None:
            return 0
        # An episode can be sampled only after it has ended and before its first step is overwritten.
        if self._config.buffer_size // self.venv.num_envs < 2 * longest:
            raise ParameterValueError(
                "buffer_size",
                self._config.buffer_size,
                f"at least 2 × num_envs × max_episode_steps = {2 * self.venv.num_envs * longest}, because hindsight "
                "replay stores one running and one finished episode of each environment",
                f"algorithm '{self.name}'",
            )
        return self.venv.num_envs * longest
