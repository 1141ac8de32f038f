"""Settings shared by the algorithms of stable-baselines3."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from frobs_algos.settings import Fraction, Schedule, Settings, schedule
from frobs_algos_sb3.networks import ActorCriticConfig, NetworkConfig

SampleFrequency = Annotated[int, Field(ge=-1)]
"""Number of steps after which gSDE draws a new noise matrix, or −1 to draw one only at the start of an iteration."""


class SB3Config(Settings):
    """Settings that every algorithm accepts.

    Attributes:
        learning_rate: Learning rate of every optimizer.
        gamma: Discount factor per control step.
        policy_kwargs: Settings of the networks.
        scale_observation: Whether to multiply observations by the scale factors that the task suggests, if any. Ignored
            if observations are normalized.
        normalize_observation: Whether to normalize observations, except for pictures, by their running mean and standard
            deviation.
        normalize_reward: Whether to divide rewards by the running standard deviation of the discounted return.
        clip_observation: Maximum absolute value of normalized observations.
        clip_reward: Maximum absolute value of normalized rewards.
        torch_threads: Number of threads for PyTorch, and for JAX in the algorithms of sbx. One thread is fastest for
            small networks and does not compete with the simulator.
        device: Device of the networks: ``cpu``, ``cuda``, …
    """

    learning_rate: Schedule = 3e-4
    gamma: Fraction = 0.99
    policy_kwargs: NetworkConfig = NetworkConfig()
    scale_observation: bool = True
    normalize_observation: bool = False
    normalize_reward: bool = False
    clip_observation: PositiveFloat = 10.0
    clip_reward: PositiveFloat = 10.0
    torch_threads: PositiveInt = 1
    device: str = "cpu"

    @property
    def scales_observation(self) -> bool:
        return self.scale_observation and not self.normalize_observation

    def model_kwargs(self) -> dict[str, Any]:
        """Return the keyword arguments of the algorithm's class in stable-baselines3."""
        return {key: value for key, value in self.model_dump().items() if key not in _OURS} | {
            "learning_rate": schedule(self.learning_rate),
            "policy_kwargs": self.policy_kwargs.to_kwargs(),
        }


_OURS = (
    "demonstrations",
    "demonstration_episodes",
    "demonstration_mapping",
    "initial_policy",
    "initial_episodes",
    "initial_updates",
    "scale_observation",
    "normalize_observation",
    "normalize_reward",
    "clip_observation",
    "clip_reward",
    "torch_threads",
)


class OnPolicyConfig(SB3Config):
    """Settings that every on-policy algorithm accepts.

    Attributes:
        n_steps: Number of steps that each environment takes per iteration.
        gae_lambda: Trade-off between one-step advantages (0) and full returns (1).
        normalize_advantage: Whether to normalize the advantages within each batch.
        ent_coef: Weight of the entropy in the loss.
        vf_coef: Weight of the value loss.
        max_grad_norm: Maximum norm of the gradients.
        use_sde: Whether to use state-dependent exploration (gSDE).
        sde_sample_freq: Number of steps after which gSDE draws a new noise matrix, or −1 to draw one only at the start
            of an iteration.
        policy_kwargs: Settings of the networks.
        initial_policy: Name or path of a policy, such as ``expert``, that the networks imitate before training starts,
            or None. ``policy_kwargs.log_std_init`` sets the exploration around its actions.
        initial_episodes: Number of episodes that the initial policy plays, with the exploration of the first rollout.
        initial_updates: Number of gradient steps of the imitation.
    """

    n_steps: PositiveInt = 2048
    gae_lambda: Fraction = 0.95
    normalize_advantage: bool = True
    ent_coef: NonNegativeFloat = 0.0
    vf_coef: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5
    use_sde: bool = False
    sde_sample_freq: SampleFrequency = -1
    policy_kwargs: ActorCriticConfig = ActorCriticConfig()
    initial_policy: str | None = None
    initial_episodes: PositiveInt = 100
    initial_updates: PositiveInt = 2000

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.policy_kwargs.squash_output and not self.use_sde:
            raise ValueError("policy_kwargs.squash_output requires use_sde: true")
        return self
