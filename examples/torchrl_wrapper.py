"""Train with TorchRL, whose `GymWrapper` accepts the batched vector environment.

The script prints the layout of a batch of experience, and then the success rate, which rises during training.

Requires: pip install torchrl frobs-sim-mujoco frobs-robots-abb frobs-controllers frobs-tasks-reach
"""

import sys

import gymnasium as gym
import torch
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 40_000
NUM_ENVS, ROLLOUT = 64, 16

torch.manual_seed(0)
envs = gym.make_vec(
    "frobs_core:frobs/Irb120Reach-v0",
    num_envs=NUM_ENVS,
    vectorization_mode="vector_entry_point",
    controller="tcp_delta_position",
    stagger=True,  # start environments at random step counts, so that every rollout contains all phases of an episode
)
env = GymWrapper(envs)  # the wrapper's batches also contain is_success from the info of each step
env.set_seed(0)


def network(outputs: int) -> nn.Sequential:
    """Return a network with two hidden layers."""
    return nn.Sequential(
        nn.Linear(env.observation_spec["observation"].shape[-1], 64),
        nn.ELU(),
        nn.Linear(64, 64),
        nn.ELU(),
        nn.Linear(64, outputs),
    )


parameters = TensorDictModule(
    nn.Sequential(network(2 * env.action_spec.shape[-1]), NormalParamExtractor()),
    in_keys=["observation"],
    out_keys=["loc", "scale"],
)
actor = ProbabilisticActor(
    parameters,
    in_keys=["loc", "scale"],
    distribution_class=TanhNormal,
    return_log_prob=True,
)
critic = ValueOperator(network(1), in_keys=["observation"])
collector = Collector(env, actor, frames_per_batch=NUM_ENVS * ROLLOUT, total_frames=STEPS)
advantage = GAE(gamma=0.9, lmbda=0.9, value_network=critic, average_gae=True)
loss = ClipPPOLoss(actor, critic, entropy_coeff=0.0)
optimizer = torch.optim.Adam(loss.parameters(), lr=2e-3)

for iteration, batch in enumerate(collector, 1):
    if iteration == 1:
        print(batch)
    for _ in range(5):
        with torch.no_grad():
            advantage(batch)
        for rows in torch.randperm(batch.numel()).split(256):
            losses = loss(batch.reshape(-1)[rows])
            optimizer.zero_grad()
            sum(losses[name] for name in ("loss_objective", "loss_critic")).backward()
            nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
            optimizer.step()
    if iteration % 10 == 0:
        ends = batch["next", "done"].squeeze(-1)
        print(f"{iteration * batch.numel():7,} steps  success {batch['next', 'is_success'][ends].mean():.0%}")

collector.shutdown()
