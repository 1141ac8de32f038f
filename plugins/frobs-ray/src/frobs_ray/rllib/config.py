"""Settings shared by RLlib's algorithms, with the same names and meanings as in ``frobs-algos-sb3``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, NonNegativeInt, PositiveInt

from frobs_algos.settings import Activation, Fraction, Schedule, Settings, Widths, schedule


class NetworkConfig(Settings):
    """Settings of the networks.

    Attributes:
        net_arch: Widths of the hidden layers of every network.
        activation_fn: Activation function between the layers.
    """

    net_arch: Widths = Field(default=[256, 256])
    activation_fn: Activation = "relu"


class RLlibConfig(Settings):
    """Settings that all of RLlib's algorithms accept.

    Attributes:
        learning_rate: Learning rate of every optimizer.
        gamma: Discount factor per control step.
        scale_observation: Whether to multiply observations by the scale that the task suggests.
        torch_threads: Number of PyTorch threads in the training process.
        num_env_runners: Number of processes that step environments. The processes may run on any node of the cluster.
            The run's ``num_envs`` environments are divided evenly among the processes. If 0, the training process steps
            the environments.
        cpus_per_env_runner: Number of processors that Ray reserves for each environment runner, which is also the
            number of threads of the runner's simulator.
        ray_address: ``host:port`` of a Ray cluster's head node, or ``auto`` for the cluster that is running on this
            machine. Defaults to a new cluster on this machine for this run only.
    """

    learning_rate: Schedule = 3e-4
    gamma: Fraction = 0.99
    scale_observation: bool = True
    torch_threads: PositiveInt = 1
    num_env_runners: NonNegativeInt = 0
    cpus_per_env_runner: PositiveInt = 1
    ray_address: Annotated[str, Field(min_length=1)] | None = None

    @property
    def scales_observation(self) -> bool:
        return self.scale_observation

    def rates(self, done: int, total: int) -> float | list[list[float]]:
        """Return the learning rate in RLlib's format.

        Args:
            done: Number of environment steps before this call to ``train``.
            total: Number of environment steps at the end of this call.

        Returns:
            The constant rate, or the points of a linear schedule. Each point consists of a number of environment steps,
            counted from the start of this call, and the learning rate.
        """
        rate = schedule(self.learning_rate)
        if not callable(rate):
            return rate
        return [[0, rate(1.0 - done / total)], [total - done, rate(0.0)]]
