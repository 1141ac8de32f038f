"""Train with skrl, whose wrapper for Gymnasium accepts the batched vector environment.

The script shows a progress bar, and then the success rate of the policy.

Requires: pip install "skrl[torch]" frobs-sim-mujoco frobs-robots-abb frobs-controllers frobs-tasks-reach
"""

import sys
from typing import Any

import gymnasium as gym
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import Tensor, nn

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 60_000
NUM_ENVS = 64


def network(inputs: int, outputs: int) -> nn.Sequential:
    """Return a network with two hidden layers."""
    return nn.Sequential(nn.Linear(inputs, 64), nn.ELU(), nn.Linear(64, 64), nn.ELU(), nn.Linear(64, outputs))


class Actor(GaussianMixin, Model):
    """Gaussian policy whose standard deviation does not depend on the observation."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)
        self.network = network(self.num_observations, self.num_actions)
        self.log_std = nn.Parameter(torch.full((self.num_actions,), -0.5))

    def compute(self, inputs: dict[str, Tensor], role: str = "") -> tuple[Tensor, dict[str, Tensor]]:
        """Return the mean and the logarithm of the standard deviation."""
        return self.network(inputs["observations"]), {"log_std": self.log_std}


class Critic(DeterministicMixin, Model):
    """Value function."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.network = network(self.num_observations, 1)

    def compute(self, inputs: dict[str, Tensor], role: str = "") -> tuple[Tensor, dict[str, Tensor]]:
        """Return the value."""
        return self.network(inputs["observations"]), {}


set_seed(0)
envs = gym.make_vec(
    "frobs_core:frobs/Irb120Reach-v0",
    num_envs=NUM_ENVS,
    vectorization_mode="vector_entry_point",
    controller="tcp_delta_position",
)
env = wrap_env(envs)
spaces = {"observation_space": env.observation_space, "action_space": env.action_space, "device": env.device}

config = PPO_CFG(
    rollouts=16,
    learning_epochs=5,
    mini_batches=4,
    learning_rate=2e-3,
    discount_factor=0.9,
    gae_lambda=0.9,
    time_limit_bootstrap=True,
)
config.experiment.write_interval = config.experiment.checkpoint_interval = 0  # write no files
agent = PPO(
    models={"policy": Actor(**spaces), "value": Critic(**spaces)},
    memory=RandomMemory(memory_size=16, num_envs=NUM_ENVS, device=env.device),
    cfg=config,
    **spaces,
)
timesteps = max(STEPS // NUM_ENVS, 16)
trainer = {"timesteps": timesteps, "headless": True, "close_environment_at_exit": False}
SequentialTrainer(env=env, agents=agent, cfg=trainer).train()

observations, infos = envs.reset(seed=1)
for _ in range(50):  # one episode in each environment
    with torch.no_grad():
        outputs = agent.act(torch.as_tensor(observations), None, timestep=timesteps, timesteps=timesteps)[1]
    observations, rewards, terminated, truncated, infos = envs.step(outputs["mean_actions"].clamp(-1.0, 1.0).numpy())
print(f"success in {infos['is_success'].mean():.0%} of {NUM_ENVS} episodes")
envs.close()
