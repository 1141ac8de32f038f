"""Train with plain stable-baselines3 on the batched vector environment.

One call steps all 64 environments. `VectorEnvAdapter` gives the vector environment the interface that
stable-baselines3 expects. The log of stable-baselines3 shows how the mean episode reward rises. At the end, the script
prints the success rate of the trained policy.

Requires: pip install frobs-algos-sb3 frobs-sim-mujoco frobs-robots-abb frobs-controllers frobs-tasks-reach
"""

import sys

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from frobs_algos_sb3.vec_env import VectorEnvAdapter

STEPS = int(sys.argv[1]) if len(sys.argv) > 1 else 60_000

envs = gym.make_vec(
    "frobs_core:frobs/Irb120Reach-v0",
    num_envs=64,
    vectorization_mode="vector_entry_point",
    controller="tcp_delta_position",
)
model = PPO(
    "MlpPolicy",
    VecMonitor(VectorEnvAdapter(envs)),  # logs the return of each episode
    n_steps=16,
    batch_size=256,
    n_epochs=5,
    learning_rate=2e-3,
    gamma=0.9,
    gae_lambda=0.9,
    policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.5},
    seed=0,
    verbose=1,
)
model.learn(STEPS, log_interval=10)

observations, infos = envs.reset(seed=1)
for _ in range(50):  # one episode in each environment
    actions = model.predict(observations, deterministic=True)[0]
    observations, rewards, terminated, truncated, infos = envs.step(actions)
print(f"success in {infos['is_success'].mean():.0%} of {envs.num_envs} episodes")
envs.close()
