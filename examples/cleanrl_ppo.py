"""PPO in a single file, in the style of CleanRL, so that you can change every line.

The training loop uses only the batched environment of FRobs. Observations, rewards and end-of-episode flags are arrays
with one row for each of the 64 environments. The script prints the success rate, which rises to more than 80 % during
training.

Requires: pip install torch frobs-sim-mujoco frobs-robots-abb frobs-controllers frobs-tasks-reach
"""

import sys

import gymnasium as gym
import numpy as np
import torch
from torch import Tensor, nn

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 60_000
NUM_ENVS, ROLLOUT, EPOCHS, BATCH = 64, 16, 5, 256
GAMMA, LAMBDA, CLIP, RATE = 0.9, 0.9, 0.2, 2e-3

torch.manual_seed(0)
torch.set_num_threads(1)  # the network is small
envs = gym.make_vec(
    "frobs_core:frobs/Irb120Reach-v0",
    num_envs=NUM_ENVS,
    vectorization_mode="vector_entry_point",
    controller="tcp_delta_position",
    stagger=True,  # start environments at random step counts, so that every rollout contains all phases of an episode
)
observation_size = gym.spaces.flatdim(envs.single_observation_space)
action_size = gym.spaces.flatdim(envs.single_action_space)


def network(outputs: int) -> nn.Sequential:
    """Return a network with two hidden layers."""
    return nn.Sequential(nn.Linear(observation_size, 64), nn.ELU(), nn.Linear(64, 64), nn.ELU(), nn.Linear(64, outputs))


actor, critic = network(action_size), network(1)
log_std = nn.Parameter(torch.full((action_size,), -0.5))
parameters = [*actor.parameters(), *critic.parameters(), log_std]
optimizer = torch.optim.Adam(parameters, lr=RATE)


def policy(observations: Tensor) -> torch.distributions.Independent:
    """Return the distribution of the actions."""
    return torch.distributions.Independent(torch.distributions.Normal(actor(observations), log_std.exp()), 1)


def tensor(array: np.ndarray) -> Tensor:
    """Return an array as a tensor of float32."""
    return torch.as_tensor(array, dtype=torch.float32)


observations = torch.zeros(ROLLOUT, NUM_ENVS, observation_size)
actions = torch.zeros(ROLLOUT, NUM_ENVS, action_size)
log_probs, rewards, ends, values = (torch.zeros(ROLLOUT, NUM_ENVS) for _ in range(4))
successes: list[float] = []
iterations = max(STEPS // (NUM_ENVS * ROLLOUT), 1)
observation = tensor(envs.reset(seed=0)[0])

for iteration in range(1, iterations + 1):
    optimizer.param_groups[0]["lr"] = RATE * (1.0 - (iteration - 1) / iterations)

    with torch.no_grad():
        for step in range(ROLLOUT):
            distribution = policy(observation)
            action = distribution.sample()
            observations[step], actions[step] = observation, action
            log_probs[step], values[step] = distribution.log_prob(action), critic(observation).squeeze(-1)
            new, reward, terminated, truncated, infos = envs.step(action.clamp(-1.0, 1.0).numpy())
            rewards[step], ends[step] = tensor(reward), tensor(terminated | truncated)
            if truncated.any():  # the time limit is not the end of the task: bootstrap the value of the last state
                last = tensor(np.stack(infos["final_obs"][truncated]))
                rewards[step, torch.as_tensor(truncated)] += GAMMA * critic(last).squeeze(-1)
                successes += list(infos["final_info"]["is_success"][truncated])
            observation = tensor(new)

        advantages = torch.zeros_like(rewards)
        following, advantage = critic(observation).squeeze(-1), torch.zeros(NUM_ENVS)
        for step in reversed(range(ROLLOUT)):
            continues = 1.0 - ends[step]
            delta = rewards[step] + GAMMA * continues * following - values[step]
            advantage = delta + GAMMA * LAMBDA * continues * advantage
            advantages[step], following = advantage, values[step]
        returns = (advantages + values).flatten()

    for _ in range(EPOCHS):
        for rows in torch.randperm(NUM_ENVS * ROLLOUT).split(BATCH):
            distribution = policy(observations.flatten(0, 1)[rows])
            ratio = (distribution.log_prob(actions.flatten(0, 1)[rows]) - log_probs.flatten()[rows]).exp()
            gain = advantages.flatten()[rows]
            gain = (gain - gain.mean()) / (gain.std() + 1e-8)
            policy_loss = -torch.min(ratio * gain, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * gain).mean()
            value_loss = (critic(observations.flatten(0, 1)[rows]).squeeze(-1) - returns[rows]).square().mean()
            optimizer.zero_grad()
            (policy_loss + 0.5 * value_loss).backward()
            nn.utils.clip_grad_norm_(parameters, 0.5)
            optimizer.step()

    if iteration % 10 == 0 or iteration == iterations:
        print(f"{iteration * NUM_ENVS * ROLLOUT:7,} steps  success {np.mean(successes[-200:] or [0.0]):.0%}")

envs.close()
